"""Contact with the ground: the geometry of wheels and structure, struts, and friction, for generated code.

Friction is found as Lagrange multipliers by a projected Gauss-Seidel method (E. Catto 2005, "Iterative dynamics with temporal coherence").
"""

import math

from tussle.aircraft.constants import AXIS_RATIO, AXIS_RATIO_SQUARED, ECCENTRICITY_SQUARED, SEMI_MAJOR
from tussle.aircraft.runtime import outlined
from tussle.numeric import atan2, cos, sin

WIDTH = 10
"""Numbers of a multiplier in the work array: direction (3), arm (3), least, most, value, used."""
MEMORY = ("along", "side", "slide", "slip", "touches", "length", "speed")
"""Kept from step to step: multipliers along, sideways and against the movement, slip angle [deg], whether it touches, compression [ft]
and its speed [ft/s]. In the work array follow steering angle [rad] (NaN: it casters), brake, altitude of the ground [ft], and force of
the strut [lbf] (NaN: that of its spring)."""
PARAMETERS = ("x", "y", "z", "is_wheel", "spring", "damping", "damping_is_square", "rebound", "rebound_is_square", "static", "dynamic",
              "rolling", "most")  # fmt: skip


@outlined
def ground_normal(rx, ry, rz):
    """Normal of the ellipsoid, in the axes of a position [ft], and the altitude above it [ft] (T. Fukushima 2006)."""
    axial = math.sqrt(rx * rx + ry * ry)
    s0 = abs(rz)
    zc = AXIS_RATIO * s0
    c0 = AXIS_RATIO * axial
    a02 = c0 * c0 + s0 * s0
    a0 = math.sqrt(a02)
    a03 = a02 * a0
    k = SEMI_MAJOR * ECCENTRICITY_SQUARED
    s1 = zc * a03 + k * s0 * s0 * s0
    c1 = axial * a03 - k * c0 * c0 * c0
    cs = k * c0 * s0
    b0 = 1.5 * cs * ((axial * s0 - zc * c0) * a0 - cs)
    s1 = s1 * a03 - b0 * s0
    cc = AXIS_RATIO * (c1 * a03 - b0 * c0)
    size = math.sqrt(s1 * s1 + cc * cc)
    altitude = (axial * cc + s0 * s1 - SEMI_MAJOR * math.sqrt(AXIS_RATIO_SQUARED * s1 * s1 + cc * cc)) / size
    rise = s1 / size if rz >= 0.0 else -s1 / size
    return cc / size * rx / axial, cc / size * ry / axial, rise, altitude


@outlined
def strut_force(tables, at, length, speed):
    """Force of a strut [lbf], at most 0, from its compression [ft] and the speed of the compression [ft/s]."""
    if speed >= 0.0:
        damping = -speed * tables[at + 5] * (speed if tables[at + 6] != 0.0 else 1.0)
    else:
        damping = -speed * tables[at + 7] * (-speed if tables[at + 8] != 0.0 else 1.0)
    return max(min(-length * tables[at + 4] + damping, 0.0), -tables[at + 12])


@outlined
def side_coefficient(peak, slip):
    """Coefficient of a tyre's side force at a slip angle [deg] (H. B. Pacejka's formula)."""
    stiff = 0.06 * slip
    return peak * sin(2.8 * atan2(stiff - 1.03 * (stiff - atan2(stiff, 1.0)), 1.0))


@outlined
def touch_all(tables, at, work, gear, center, place, m, up, motion, dt):
    """Compute all contacts: their forces, and their multipliers in `work`.

    Args:
        tables: Holds PARAMETERS of each contact from `at` on.
        at: Their place.
        work: Two multipliers for each contact, (2 k, WIDTH); written.
        gear: MEMORY of each contact, (k, 11); written.
        center: Centre of gravity in the structural frame [in].
        place: Inertial position of the centre [ft].
        m: Rotation from inertial to body axes, by rows.
        up: The vertical at the centre, downwards, inertial axes.
        motion: Velocity and angular velocity, body axes.
        dt: [s].

    Returns:
        Force and moment about the centre of gravity, body axes, and whether any contact touches, 1 or 0.
    """
    fx, fy, fz, mx, my, mz, touching = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(gear.shape[0]):
        a, b, c, d, e, f = touch(tables, at + k * 13, work, gear, k, center, place, m, up, motion, dt)
        fx, fy, fz, mx, my, mz = fx + a, fy + b, fz + c, mx + d, my + e, mz + f
        touching = max(touching, gear[k, 4])
    return fx, fy, fz, mx, my, mz, touching


@outlined
def remember(work, gear):
    """Write the values of the multipliers to the memory of the contacts."""
    for k in range(gear.shape[0]):
        a, b = 2 * k, 2 * k + 1
        is_used, is_wheel = work[a, 9] != 0.0, work[b, 9] != 0.0
        gear[k, 0] = work[a, 8] if is_wheel else 0.0
        gear[k, 1] = work[b, 8] if is_wheel else 0.0
        gear[k, 2] = work[a, 8] if is_used and not is_wheel else 0.0


@outlined
def touch(tables, at, work, gear, k, center, place, m, up, motion, dt):
    """Compute contact k, as `touch_all` does. Returns force and moment about the centre of gravity."""
    m11, m12, m13, m21, m22, m23, m31, m32, m33 = m
    u, v, w, p, q, r = motion
    ax, ay, az = (
        (center[0] - tables[at]) / 12.0,
        (tables[at + 1] - center[1]) / 12.0,
        (center[2] - tables[at + 2]) / 12.0,
    )
    nx, ny, nz, altitude = ground_normal(
        place[0] + m11 * ax + m21 * ay + m31 * az,
        place[1] + m12 * ax + m22 * ay + m32 * az,
        place[2] + m13 * ax + m23 * ay + m33 * az,
    )
    steering, brake, first = gear[k, 7], gear[k, 8], 2 * k
    height = altitude - gear[k, 9]
    work[first, 9] = work[first + 1, 9] = 0.0
    if not height < 0.0:
        for j in range(7):
            gear[k, j] = 0.0
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    gx, gy, gz = (
        m11 * nx + m12 * ny + m13 * nz,
        m21 * nx + m22 * ny + m23 * nz,
        m31 * nx + m32 * ny + m33 * nz,
    )
    drop = nx * up[0] + ny * up[1] + nz * up[2]
    is_wheel = tables[at + 3] != 0.0
    project = -gz
    if is_wheel:
        length = height * drop / project if project > 0.0 else 0.0
        ex, ey, ez = ax, ay, az - length
    else:
        length = height * drop
        ex, ey, ez = ax + length * gx, ay + length * gy, az + length * gz
    vx, vy, vz = u + q * ez - r * ey, v + r * ex - p * ez, w + p * ey - q * ex
    if steering != steering:
        steering = atan2(vy, abs(vx)) if math.sqrt(vx * vx + vy * vy) > 1e-3 else 0.0
    # Axes on the ground: along the wheel, sideways, up.
    tx, ty = cos(steering), sin(steering)
    sx, sy, sz = -gz * ty, gz * tx, gx * ty - gy * tx
    size = math.sqrt(sx * sx + sy * sy + sz * sz)
    sx, sy, sz = sx / size, sy / size, sz / size
    along = tx * gx + ty * gy
    lx, ly, lz = tx - along * gx, ty - along * gy, -along * gz
    size = math.sqrt(lx * lx + ly * ly + lz * lz)
    lx, ly, lz = lx / size, ly / size, lz / size
    forward, left = lx * vx + ly * vy + lz * vz, sx * vx + sy * vy + sz * vz
    rise = gx * vx + gy * vy + gz * vz
    # A contact that begins in this step cannot have been faster than its compression in the step.
    most = abs(length) / dt if dt != 0.0 else 0.0
    speed = min(max(-rise / project if is_wheel else -rise, -most), most)
    strut = gear[k, 10] if gear[k, 10] == gear[k, 10] else strut_force(tables, at, length, speed)
    load = strut / -project if is_wheel else -strut
    slide = math.sqrt(forward * forward + left * left)
    slip = gear[k, 3]
    if is_wheel:
        if slide > 1e-3:
            slip = -atan2(left, abs(forward)) * 57.29577951308232
        rolling = tables[at + 11] * (1.0 - brake) + tables[at + 9] * brake
        limits = abs(rolling * load), abs(side_coefficient(tables[at + 9], slip) * load)
    else:
        limits = abs(tables[at + 9] * load), abs(tables[at + 9] * load)
    if not is_wheel and slide > 1e-3:
        a, b = forward / slide, left / slide
        write(
            work,
            first,
            (a * lx + b * sx, a * ly + b * sy, a * lz + b * sz),
            (ex, ey, ez),
            -abs(tables[at + 10] * load),
            0.0,
            gear[k, 2],
        )
    else:
        write(work, first, (lx, ly, lz), (ex, ey, ez), -limits[0], limits[0], gear[k, 0])
        write(work, first + 1, (sx, sy, sz), (ex, ey, ez), -limits[1], limits[1], gear[k, 1])
    fx, fy, fz = load * gx, load * gy, load * gz
    gear[k, 3], gear[k, 4], gear[k, 5], gear[k, 6] = slip, 1.0, length, speed
    return fx, fy, fz, ey * fz - ez * fy, ez * fx - ex * fz, ex * fy - ey * fx


@outlined
def write(work, k, direction, arm, least, most, value):
    """Write a multiplier."""
    work[k, 0], work[k, 1], work[k, 2] = direction
    work[k, 3], work[k, 4], work[k, 5] = arm
    work[k, 6], work[k, 7], work[k, 8], work[k, 9] = least, most, min(max(value, least), most), 1.0


@outlined
def friction(work, matrix, mass, inverse, rates, motion, dt):
    """Find the forces of friction that hold the contacts, within their limits.

    Args:
        work: Multipliers, (k, WIDTH); their values are written.
        matrix: Room for (k, k + 1) numbers.
        mass: [slug].
        inverse: Inverse of the inertia: xx, xy, xz, yy, yz, zz.
        rates: Rates of the velocity and of the angular velocity, body axes, without friction.
        motion: Velocity and angular velocity, body axes.
        dt: [s].

    Returns:
        Force and moment about the centre of gravity, body axes.
    """
    n = work.shape[0]
    ixx, ixy, ixz, iyy, iyz, izz = inverse
    ax, ay, az, bx, by, bz = rates
    if dt > 0.0:
        ax, ay, az = ax + motion[0] / dt, ay + motion[1] / dt, az + motion[2] / dt
        bx, by, bz = bx + motion[3] / dt, by + motion[4] / dt, bz + motion[5] / dt
    for i in range(n):
        if work[i, 9] == 0.0:
            continue
        ux, uy, uz, x, y, z = work[i, 0], work[i, 1], work[i, 2], work[i, 3], work[i, 4], work[i, 5]
        cx, cy, cz = y * uz - z * uy, z * ux - x * uz, x * uy - y * ux
        tx, ty, tz = (
            ixx * cx + ixy * cy + ixz * cz,
            ixy * cx + iyy * cy + iyz * cz,
            ixz * cx + iyz * cy + izz * cz,
        )
        for j in range(n):
            rx, ry, rz = work[j, 3], work[j, 4], work[j, 5]
            vx, vy, vz = (
                ux / mass + ty * rz - tz * ry,
                uy / mass + tz * rx - tx * rz,
                uz / mass + tx * ry - ty * rx,
            )
            matrix[i, j] = work[j, 0] * vx + work[j, 1] * vy + work[j, 2] * vz
        d = matrix[i, i]
        vx, vy, vz = ax + by * z - bz * y, ay + bz * x - bx * z, az + bx * y - by * x
        matrix[i, n] = -(ux * vx + uy * vy + uz * vz) / d
        for j in range(n):
            matrix[i, j] /= d
    for _ in range(50):
        norm = 0.0
        for i in range(n):
            if work[i, 9] == 0.0:
                continue
            old = work[i, 8]
            change = matrix[i, n]
            for j in range(n):
                if work[j, 9] != 0.0:
                    change -= matrix[i, j] * work[j, 8]
            work[i, 8] = min(max(old + change, work[i, 6]), work[i, 7])
            norm += abs(work[i, 8] - old)
        if norm < 1e-5:
            break
    fx, fy, fz, mx, my, mz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(n):
        if work[i, 9] != 0.0:
            value = work[i, 8]
            ux, uy, uz, x, y, z = (
                value * work[i, 0],
                value * work[i, 1],
                value * work[i, 2],
                work[i, 3],
                work[i, 4],
                work[i, 5],
            )
            fx, fy, fz = fx + ux, fy + uy, fz + uz
            mx, my, mz = mx + y * uz - z * uy, my + z * ux - x * uz, mz + x * uy - y * ux
    return fx, fy, fz, mx, my, mz
