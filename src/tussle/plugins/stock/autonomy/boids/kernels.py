"""Boids kernels: repulsion, the steering law and the command outputs.

A step runs the plugin's neighbour laws, `historic_means` if selected, `law`, and those of `velocity`, `rates` and `desired`
whose outputs are wired.
"""

from __future__ import annotations

import math

import numpy as np

from tussle.numeric import atan2, cos, sin, wrap
from tussle.numeric.kernel import device, kernel
from tussle.numeric.neighbors.lane_count import LANES
from tussle.numeric.neighbors.lanes import choose, inverse_sqrt, load_some, splat, store_some

TOUCHING = 1e10
"""Magnitude of the repulsion at or below the minimum range, in place of infinity (value of SCRIMMAGE)."""

# Rows of the neighbour sums, (13, n): offsets [m] and horizontal heading vectors of team mates, number of team mates and of
# others, repulsion from team mates and from others.
OFFSET, HEADING, N_TEAM, N_OTHERS, TEAM_PUSH, OTHER_PUSH = 0, 3, 5, 6, 7, 10


def push(
    x: float, y: float, z: float, square: float, inverse: float, sphere: float, least: float
) -> tuple[float, float, float]:
    """Repulsion from a neighbour at offset (x, y, z) [m] and distance r.

    The magnitude is TOUCHING for r <= least, else (sphere - r) / (sphere - least). `square` is r^2, `inverse` is 1 / r.
    """
    scale = 1.0 / (sphere - least)
    amount = TOUCHING * inverse if square <= least * least else scale * (sphere * inverse - 1.0)
    return -amount * x, -amount * y, -amount * z


@kernel("(F F F) F2w")
def historic_means(pos, seen):
    """Convert the neighbour sums, (13, n), to the centroid and heading of SCRIMMAGE, in place.

    SCRIMMAGE divides by the number of all neighbours, other teams included, which biases the centroid towards
    the world's origin and the heading towards East. It averages yaw as a plain number: on input, row `HEADING` is the
    sum of yaw [rad]. pos: own positions [m], (n,) each.
    """
    x, y, z = pos
    for i in range(x.shape[0]):
        count = max(seen[N_TEAM, i] + seen[N_OTHERS, i], 1.0)
        share = seen[N_TEAM, i] / count - 1.0
        seen[OFFSET, i] = seen[OFFSET, i] / count + share * x[i]
        seen[OFFSET + 1, i] = seen[OFFSET + 1, i] / count + share * y[i]
        seen[OFFSET + 2, i] = seen[OFFSET + 2, i] / count + share * z[i]
        mean = seen[HEADING, i] / count
        seen[HEADING, i] = cos(mean)
        seen[HEADING + 1, i] = sin(mean)


@device
def rows(array, first, i, m):
    """Load rows first to first + 2 of an array at columns i to i + m - 1."""
    return load_some(array[first], i, m), load_some(array[first + 1], i, m), load_some(array[first + 2], i, m)


@device
def put_rows(array, i, m, x, y, z):
    """Store three rows of an array at columns i to i + m - 1."""
    store_some(array[0], i, m, x)
    store_some(array[1], i, m, y)
    store_some(array[2], i, m, z)


@device
def shortened(x, y, z):
    """Unit vector of (x, y, z); zero for a zero vector."""
    inverse = inverse_sqrt(x * x + y * y + z * z)
    return x * inverse, y * inverse, z * inverse


@device
def nose(w, x, y, z):
    """Body x axis (east, north, up) of a quaternion, in units of its squared length."""
    return w * w + x * x - y * y - z * z, 2.0 * (w * z + x * y), 2.0 * (x * z - w * y)


@device
def length(x, y, z):
    """Length of (x, y, z)."""
    square = x * x + y * y + z * z
    return square * inverse_sqrt(square)


@kernel("F F -> b1")
def sees_all(fov_az, fov_el):
    """Return whether the fields of view [rad], (n,) each, exclude no entity."""
    for i in range(fov_az.shape[0]):
        if fov_az[i] < 2.0 * math.pi or fov_el[i] <= math.pi:
            return False
    return True


@kernel("(F F F) F2 F2 (F F F F F F) F2w (i8 i8)")
def law(pos, goal, seen, weights, wanted, part):
    """Compute the desired velocity.

    The weighted sum of the five unit or repulsion vectors, divided by the sum of their lengths, times max_speed. The length
    of the heading enters the divisor without its weight, as in SCRIMMAGE. Without neighbours the velocity is 1 m/s
    in the direction of the goal.

    Args:
        pos: Positions [m], three (n,).
        goal: Goals [m], (3, n).
        seen: Neighbour sums, (13, n).
        weights: max_speed [m/s] and the weights of goal, team mates, others, centroid and alignment, (n,) each.
        wanted: Desired velocity [m/s], (3, n), written.
        part: First row, and end of the rows to compute.
    """
    px, py, pz = pos
    max_speed, goal_weight, team_weight, other_weight, centroid_weight, align_weight = weights
    for i in range(part[0], part[1], LANES):
        m = min(LANES, part[1] - i)
        gx, gy, gz = rows(goal, 0, i, m)
        gx, gy, gz = shortened(gx - load_some(px, i, m), gy - load_some(py, i, m), gz - load_some(pz, i, m))
        cx, cy, cz = rows(seen, OFFSET, i, m)
        cx, cy, cz = shortened(cx, cy, cz)
        hx, hy, alone = rows(seen, HEADING, i, m)
        hx, hy, hz = shortened(hx, hy, splat(0.0))
        tx, ty, tz = rows(seen, TEAM_PUSH, i, m)
        ox, oy, oz = rows(seen, OTHER_PUSH, i, m)
        wg, wt, wo = load_some(goal_weight, i, m), load_some(team_weight, i, m), load_some(other_weight, i, m)
        wc, wa = load_some(centroid_weight, i, m), load_some(align_weight, i, m)
        total = (
            wg * length(gx, gy, gz) + wt * length(tx, ty, tz) + wo * length(ox, oy, oz) + wc * length(cx, cy, cz)
            + length(hx, hy, hz)
        )  # fmt: skip
        gain = load_some(max_speed, i, m) / choose(total > 0.0, total, 1.0)
        alone = alone + load_some(seen[N_OTHERS], i, m) == 0.0
        vx = gain * (wg * gx + wt * tx + wo * ox + wc * cx + wa * hx)
        vy = gain * (wg * gy + wt * ty + wo * oy + wc * cy + wa * hy)
        vz = gain * (wg * gz + wt * tz + wo * oz + wc * cz + wa * hz)
        put_rows(wanted, i, m, choose(alone, gx, vx), choose(alone, gy, vy), choose(alone, gz, vz))


@kernel("F2 F F2w")
def velocity(wanted, max_speed, out):
    """Velocity command [m/s], (3, n): max_speed in the direction of the desired velocity; 0 where that is 0."""
    for i in range(0, max_speed.shape[0], LANES):
        m = min(LANES, max_speed.shape[0] - i)
        vx, vy, vz = rows(wanted, 0, i, m)
        speed = length(vx, vy, vz)
        factor = load_some(max_speed, i, m) / choose(speed > 0.0, speed, 1.0)
        put_rows(out, i, m, vx * factor, vy * factor, vz * factor)


@kernel("F2 F F2w")
def historic_velocity(wanted, max_speed, out):
    """Velocity command [m/s], (3, n), of SCRIMMAGE: the desired velocity, limited to max_speed / 2 where it exceeds 1 m/s."""
    for i in range(0, max_speed.shape[0], LANES):
        m = min(LANES, max_speed.shape[0] - i)
        vx, vy, vz = rows(wanted, 0, i, m)
        speed = length(vx, vy, vz)
        factor = 0.5 * load_some(max_speed, i, m) / choose(speed > 1.0, speed, 1.0)
        factor = choose(factor < 1.0, factor, 1.0)
        put_rows(out, i, m, vx * factor, vy * factor, vz * factor)


@kernel("F2 (F F F F) F Fw Fw Fw (i8 i8)")
def rates(wanted, quat, max_speed, speed, turn_rate, pitch_rate, part):
    """Speed [m/s] and the rates [rad/s] that turn the body x axis of quaternions (w, x, y, z) towards the desired velocity."""
    begin, end = part
    vx, vy, vz = wanted[0, begin:end], wanted[1, begin:end], wanted[2, begin:end]
    qw, qx, qy, qz = quat[0][begin:end], quat[1][begin:end], quat[2][begin:end], quat[3][begin:end]
    max_speed = max_speed[begin:end]
    speed, turn_rate, pitch_rate = speed[begin:end], turn_rate[begin:end], pitch_rate[begin:end]
    for i in range(end - begin):
        east, north, _ = nose(qw[i], qx[i], qy[i], qz[i])
        turn_rate[i] = atan2(north, east)
    for i in range(end - begin):
        turn_rate[i] = wrap(atan2(vy[i], vx[i]) - turn_rate[i])
    for i in range(end - begin):
        east, north, up = nose(qw[i], qx[i], qy[i], qz[i])
        pitch_rate[i] = atan2(up, np.sqrt(east * east + north * north))
    for i in range(end - begin):
        pitch_rate[i] = wrap(atan2(vz[i], np.sqrt(vx[i] * vx[i] + vy[i] * vy[i])) - pitch_rate[i])
    for i in range(end - begin):
        speed[i] = max_speed[i]


@kernel("(F F F) (F F F F) F2 F2 (F F F F F F) F2w (Fw Fw Fw) (i8 i8)")
def law_and_rates(pos, quat, goal, seen, weights, wanted, commands, part):
    """Compute the desired velocity as `law`, and the commands speed, turn_rate, pitch_rate as `rates`, in one call."""
    law(pos, goal, seen, weights, wanted, part)
    rates(wanted, quat, weights[0], commands[0], commands[1], commands[2], part)


@kernel("F2 F F Fw Fw Fw")
def desired(wanted, z, max_speed, heading, speed, altitude):
    """Heading of the desired velocity [rad], max_speed [m/s], and the altitude [m] after one second at the desired climb speed."""
    for i in range(z.shape[0]):
        heading[i] = atan2(wanted[1, i], wanted[0, i])
    for i in range(z.shape[0]):
        speed[i] = max_speed[i]
        altitude[i] = z[i] + wanted[2, i]
