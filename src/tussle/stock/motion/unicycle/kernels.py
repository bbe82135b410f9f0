"""Unicycle kernels: RK4 over any number of substeps in closed form, and the state made public.

With speed and rates held over a step the derivative depends on time only, so RK4 is Simpson's rule, and its sum over
N substeps of h is geometric. For an angle a with rate w and delta = h w / 2:

    h/6 sum_s [cos a_s + 4 cos(a_s + delta) + cos(a_s + 2 delta)] = N h g(delta) cos(a + N delta),
    g(delta) = (2 + cos delta)/3 * sin(N delta) / (N sin delta),

and the same for sin. With pitch, cos(pitch) cos(yaw) is split into the angles yaw + pitch and yaw - pitch. The result
is RK4's up to rounding (and with less of it), and 12 substeps cost as much as one. Advancing cosine and sine by a
rotation per substep was the alternative: as exact, but its cost grows with the substeps.

Rows are worked in blocks through scratch arrays, all angles of a block in one flat loop, because LLVM vectorises
loops over few arrays only. Each row sees the same operations wherever it stands.
"""

from __future__ import annotations

import math

import numpy as np

from tussle.numeric import atan2, sincos
from tussle.numeric.kernel import device, kernel

BLOCK = 128  # rows; the scratch of a block (some 32 kB) stays in the first-level cache
INVERSE_PI = 1.0 / math.pi
ROUNDER = 6755399441055744.0  # 1.5 * 2**52: added and taken away again, it rounds to a whole number
PI_HIGH = 2.0 * 1.57079632673412561417  # 33 bits of pi: k * PI_HIGH is exact for |k| < 2**20
PI_LOW = math.pi - PI_HIGH  # exact; together they miss pi by 1e-16
GRAVITY = 9.81


@device
def clamp(value, limit):
    """Value held within [-limit, limit]."""
    return min(max(value, -limit), limit)


@device
def fold(delta):
    """(delta - k pi in [-pi/2, pi/2], 1.0 if k is odd else 0.0), so that sin(N d)/sin(d) stays away from 0/0 beside k pi."""
    k = (delta * INVERSE_PI + ROUNDER) - ROUNDER
    odd = abs(k - 2.0 * ((0.5 * k + ROUNDER) - ROUNDER))
    return (delta - k * PI_HIGH) - k * PI_LOW, odd


@device
def simpson_gain(sin_delta, cos_delta, sin_n_delta, odd, n, n_is_even):
    """g(delta) of the module's docstring from sines of the folded delta; `odd` is the parity of the folding, n the substeps."""
    cosine = cos_delta - 2.0 * odd * cos_delta
    ratio = sin_n_delta / (n * sin_delta)
    ratio = 1.0 if sin_delta == 0.0 else ratio
    ratio = ratio - 2.0 * odd * n_is_even * ratio
    return (2.0 + cosine) * ratio * (1.0 / 3.0)


@kernel("F2w F2 F2 f8 i8")
def advance_pitch(x, u, p, dt, substeps):
    """Advance the unicycle that pitches, in place.

    Args:
        x: x, y, z [m], yaw, pitch [rad], (5, n), world frame, pitch nose up.
        u: speed [m/s], turn_rate, pitch_rate [rad/s], (3, n).
        p: vel_max [m/s], turn_rate_max, pitch_rate_max [rad/s], further rows unused, (>= 3, n).
        dt: Duration [s].
        substeps: Number of equal RK4 steps in dt.
    """
    east, north, up, yaw, pitch = x[0], x[1], x[2], x[3], x[4]
    speed, turn_rate, pitch_rate = u[0], u[1], u[2]
    vel_max, turn_max, pitch_max = p[0], p[1], p[2]
    count = float(substeps)
    n_is_even = 1.0 if substeps % 2 == 0 else 0.0
    half_dt = 0.5 * dt
    half_h = half_dt / count
    angle = np.empty(8 * BLOCK)
    sine = np.empty(8 * BLOCK)
    cosine = np.empty(8 * BLOCK)
    delta = np.empty(3 * BLOCK)
    gain = np.empty(3 * BLOCK)
    length = np.empty(BLOCK)
    n = x.shape[1]
    for first in range(0, n, BLOCK):
        m = min(BLOCK, n - first)
        for l in range(m):
            i = first + l
            turn = clamp(turn_rate[i], turn_max[i])
            raised = clamp(pitch_rate[i], pitch_max[i])
            length[l] = clamp(speed[i], vel_max[i]) * dt
            angle[l] = yaw[i] + half_dt * turn
            angle[m + l] = pitch[i] + half_dt * raised
            delta[l] = half_h * turn + half_h * raised
            delta[m + l] = half_h * turn - half_h * raised
            delta[2 * m + l] = half_h * raised
            yaw[i] += dt * turn
            pitch[i] += dt * raised
        for j in range(3 * m):
            folded, odd = fold(delta[j])
            angle[2 * m + j] = folded
            angle[5 * m + j] = count * folded
            gain[j] = odd
        for j in range(8 * m):
            sine[j], cosine[j] = sincos(angle[j])
        for j in range(3 * m):
            gain[j] = simpson_gain(
                sine[2 * m + j], cosine[2 * m + j], sine[5 * m + j], gain[j], count, n_is_even
            )
        for l in range(m):
            i = first + l
            cc = cosine[l] * cosine[m + l]
            ss = sine[l] * sine[m + l]
            sc = sine[l] * cosine[m + l]
            cs = cosine[l] * sine[m + l]
            plus = 0.5 * gain[l]
            minus = 0.5 * gain[m + l]
            east[i] += length[l] * (plus * (cc - ss) + minus * (cc + ss))
            north[i] += length[l] * (plus * (sc + cs) + minus * (sc - cs))
            up[i] += length[l] * (gain[2 * m + l] * sine[m + l])


@kernel("F2w F2 F2 f8 i8")
def advance_level(x, u, p, dt, substeps):
    """Advance the unicycle whose pitch is held and whose climb speed is an input, in place.

    Args:
        x: x, y, z [m], yaw, pitch [rad], (5, n), world frame.
        u: speed [m/s], turn_rate [rad/s], velocity_z [m/s], (3, n).
        p: vel_max [m/s], turn_rate_max, pitch_rate_max (unused) [rad/s], velocity_z_max [m/s], (>= 4, n).
        dt: Duration [s].
        substeps: Number of equal RK4 steps in dt.
    """
    east, north, up, yaw, pitch = x[0], x[1], x[2], x[3], x[4]
    speed, turn_rate, velocity_z = u[0], u[1], u[2]
    vel_max, turn_max, velocity_z_max = p[0], p[1], p[3]
    count = float(substeps)
    n_is_even = 1.0 if substeps % 2 == 0 else 0.0
    half_dt = 0.5 * dt
    half_h = half_dt / count
    angle = np.empty(4 * BLOCK)
    sine = np.empty(4 * BLOCK)
    cosine = np.empty(4 * BLOCK)
    parity = np.empty(BLOCK)
    length = np.empty(BLOCK)
    n = x.shape[1]
    for first in range(0, n, BLOCK):
        m = min(BLOCK, n - first)
        for l in range(m):
            i = first + l
            turn = clamp(turn_rate[i], turn_max[i])
            folded, odd = fold(half_h * turn)
            length[l] = clamp(speed[i], vel_max[i]) * dt
            angle[l] = yaw[i] + half_dt * turn
            angle[m + l] = pitch[i]
            angle[2 * m + l] = folded
            angle[3 * m + l] = count * folded
            parity[l] = odd
            yaw[i] += dt * turn
            up[i] += dt * clamp(velocity_z[i], velocity_z_max[i])
        for j in range(4 * m):
            sine[j], cosine[j] = sincos(angle[j])
        for l in range(m):
            i = first + l
            gain = simpson_gain(
                sine[2 * m + l], cosine[2 * m + l], sine[3 * m + l], parity[l], count, n_is_even
            )
            travelled = length[l] * cosine[m + l] * gain
            east[i] += travelled * cosine[l]
            north[i] += travelled * sine[l]


@device
def from_half_angles(sr, cr, sp, cp, sy, cy):
    """Quaternion (w, x, y, z) from sine and cosine of half the roll, quaternion pitch (nose down) and yaw."""
    return (
        cr * (cp * cy) + sr * (sp * sy),
        sr * (cp * cy) - cr * (sp * sy),
        cr * (sp * cy) + sr * (cp * sy),
        cr * (cp * sy) - sr * (sp * cy),
    )


@device
def mean_direction(sy, cy, sp, cp, sd, cd, se, ce):
    """Simpson's mean direction (three numbers) over the substep that ends at a yaw and pitch.

    From sine and cosine of yaw, of pitch (nose up), and of half of what yaw and pitch turned in the substep.
    """
    sa, ca = sy * cd - cy * sd, cy * cd + sy * sd
    sb, cb = sp * ce - cp * se, cp * ce + sp * se
    plus = (2.0 + (cd * ce - sd * se)) * (1.0 / 6.0)
    minus = (2.0 + (cd * ce + sd * se)) * (1.0 / 6.0)
    east = plus * (ca * cb - sa * sb) + minus * (ca * cb + sa * sb)
    north = plus * (sa * cb + ca * sb) + minus * (sa * cb - ca * sb)
    return east, north, (2.0 + ce) * sb * (1.0 / 3.0)


@kernel("F2 F F F F F F b1 b1 f8 Fw Fw Fw Fw Fw Fw Fw Fw Fw Fw Fw Fw Fw")
def to_body(
    x, speed, turn_rate, third, vel_max, turn_max, third_max, pitches, banks, h,
    east, north, up, qw, qx, qy, qz, vx, vy, vz, wx, wy, wz,
):  # fmt: skip
    """Publish position, attitude, velocity and turn rate.

    The velocity is the displacement of the last substep over its length: Simpson's mean over the arc that ends at x,
    which needs no memory of where the row stood before.

    Args:
        x: x, y, z [m], yaw, pitch [rad], (5, n), world frame, pitch nose up.
        speed: Commanded speed [m/s], (n,).
        turn_rate: Commanded turn rate [rad/s], (n,).
        third: Commanded pitch rate [rad/s] if `pitches`, else climb speed [m/s], (n,).
        vel_max: Limit of speed [m/s], (n,).
        turn_max: Limit of turn_rate [rad/s], (n,).
        third_max: Limit of `third`, (n,).
        pitches: Whether pitch is steered.
        banks: Whether the vehicle shows the bank of a coordinated turn.
        h: Length of the last substep [s].
        east, north, up: Position [m], (n,), written.
        qw, qx, qy, qz: Quaternion body to world, (n,), written.
        vx, vy, vz: Velocity [m/s], (n,), world frame, written.
        wx, wy, wz: Turn rate [rad/s], (n,), world frame, written.
    """
    east[:] = x[0]
    north[:] = x[1]
    up[:] = x[2]
    yaw, pitch = x[3], x[4]
    half_h = 0.5 * h
    angle, sine, cosine = np.empty(5 * BLOCK), np.empty(5 * BLOCK), np.empty(5 * BLOCK)
    for first in range(0, x.shape[1], BLOCK):
        m = min(BLOCK, x.shape[1] - first)
        for l in range(m):
            i = first + l
            raised = half_h * clamp(third[i], third_max[i])
            angle[l] = 0.5 * yaw[i]
            angle[m + l] = -0.5 * pitch[i]
            angle[2 * m + l] = half_h * clamp(turn_rate[i], turn_max[i])
            angle[3 * m + l] = raised if pitches else 0.0
        if banks:
            for l in range(m):
                i = first + l
                sideways = clamp(speed[i], vel_max[i]) * clamp(turn_rate[i], turn_max[i])
                angle[4 * m + l] = -0.5 * atan2(sideways, GRAVITY)
        for j in range(5 * m if banks else 4 * m):
            sine[j], cosine[j] = sincos(angle[j])
        if not banks:
            sine[4 * m : 5 * m] = 0.0
            cosine[4 * m : 5 * m] = 1.0
        for l in range(m):
            i, b, r = first + l, m + l, 4 * m + l
            qw[i], qx[i], qy[i], qz[i] = from_half_angles(
                sine[r], cosine[r], sine[b], cosine[b], sine[l], cosine[l]
            )
        for l in range(
            m
        ):  # from half the yaw to the yaw, from half the quaternion pitch to the pitch (nose up)
            sy, cy, sp, cp = sine[l], cosine[l], sine[m + l], cosine[m + l]
            sine[l], cosine[l] = 2.0 * sy * cy, cy * cy - sy * sy
            sine[m + l], cosine[m + l] = -2.0 * sp * cp, cp * cp - sp * sp
        for l in range(m):
            i, b, d, e = first + l, m + l, 2 * m + l, 3 * m + l
            mean_x, mean_y, mean_z = mean_direction(
                sine[l], cosine[l], sine[b], cosine[b], sine[d], cosine[d], sine[e], cosine[e]
            )
            ahead = clamp(speed[i], vel_max[i])
            vx[i] = ahead * mean_x
            vy[i] = ahead * mean_y
            vz[i] = ahead * mean_z if pitches else clamp(third[i], third_max[i])
        for l in range(m):
            i = first + l
            raised = clamp(third[i], third_max[i]) if pitches else 0.0
            wx[i] = raised * sine[l]
            wy[i] = -raised * cosine[l]
            wz[i] = clamp(turn_rate[i], turn_max[i])
