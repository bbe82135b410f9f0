"""Unicycle3D kernels: with constant body rates each substep is the same rotation, so a row needs one sine and cosine per call.

The attitude is exact up to rounding. The path is integrated with Simpson's rule over each substep, of fourth order like
RK4. The alternative, RK4 on the quaternion, drifts off the unit sphere and needs a correction term.
"""

import math

from tussle.numeric import sincos
from tussle.numeric.kernel import device, kernel
from tussle.numeric.quaternion import quat_multiply


@device
def clamp(value, limit):
    """Value clamped to [-limit, limit]."""
    return min(max(value, -limit), limit)


@device
def forward(w, x, y, z):
    """Body x axis of a unit quaternion (east, north, up)."""
    return 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)


@device
def fly(x, i, p_rate, q_rate, r_rate, speed, acceleration, speed_max, dt, substeps):
    """Advance row i by dt at constant body rates about x (right wing down), y (nose down) and z (left) [rad/s].

    The speed changes at `acceleration` [m/s^2]; at the end of each substep it is clamped to its limit.
    """
    h = dt / substeps
    rate = math.sqrt(p_rate * p_rate + q_rate * q_rate + r_rate * r_rate)
    sine, dw = sincos(0.25 * h * rate)
    gain = sine / rate if rate > 0.0 else 0.25 * h
    dx, dy, dz = gain * p_rate, gain * q_rate, gain * r_rate
    w, a, b, c = x[3, i], x[4, i], x[5, i], x[6, i]
    east, north, up = x[0, i], x[1, i], x[2, i]
    v0 = speed
    fx, fy, fz = forward(w, a, b, c)
    for _ in range(substeps):
        v1 = v0 if acceleration == 0.0 else clamp(v0 + h * acceleration, speed_max)
        vm = 0.5 * (v0 + v1)
        w, a, b, c = quat_multiply(w, a, b, c, dw, dx, dy, dz)
        mx, my, mz = forward(w, a, b, c)
        w, a, b, c = quat_multiply(w, a, b, c, dw, dx, dy, dz)
        ex, ey, ez = forward(w, a, b, c)
        east += h / 6.0 * (v0 * fx + 4.0 * vm * mx + v1 * ex)
        north += h / 6.0 * (v0 * fy + 4.0 * vm * my + v1 * ey)
        up += h / 6.0 * (v0 * fz + 4.0 * vm * mz + v1 * ez)
        v0, fx, fy, fz = v1, ex, ey, ez
    length = math.sqrt(w * w + a * a + b * b + c * c)
    x[0, i], x[1, i], x[2, i] = east, north, up
    x[3, i], x[4, i], x[5, i], x[6, i] = w / length, a / length, b / length, c / length
    x[7, i] = v0


@kernel("F2w F2 F2 f8 i8")
def advance_speed(x, u, p, dt, substeps):
    """Advance vehicles whose speed is commanded, in place.

    Args:
        x: x, y, z [m], quaternion w, x, y, z body to world, speed [m/s], (8, n).
        u: speed [m/s], turn_rate, pitch_rate, roll_rate [rad/s], (4, n).
        p: speed_max [m/s], turn_rate_max, pitch_rate_max, roll_rate_max [rad/s], (>= 4, n).
        dt: Duration [s].
        substeps: Number of equal substeps in dt.
    """
    for i in range(x.shape[1]):
        speed = clamp(u[0, i], p[0, i])
        turn, rise, bank = clamp(u[1, i], p[1, i]), clamp(u[2, i], p[2, i]), clamp(u[3, i], p[3, i])
        fly(x, i, bank, -rise, turn, speed, 0.0, p[0, i], dt, substeps)


@kernel("F2w F2 F2 f8 f8 i8")
def advance_acceleration(x, u, p, accel_max, dt, substeps):
    """Advance vehicles whose acceleration is commanded, in place.

    Args:
        x: As in `advance_speed`, (8, n).
        u: acceleration_x [m/s^2], turn_rate, pitch_rate, roll_rate [rad/s], (4, n).
        p: As in `advance_speed`, (>= 4, n).
        accel_max: Limit of the acceleration [m/s^2].
        dt: Duration [s].
        substeps: Number of equal substeps in dt.
    """
    for i in range(x.shape[1]):
        pull = clamp(u[0, i], accel_max)
        turn, rise, bank = clamp(u[1, i], p[1, i]), clamp(u[2, i], p[2, i]), clamp(u[3, i], p[3, i])
        speed = clamp(x[7, i], p[0, i])
        fly(x, i, bank, -rise, turn, speed, pull, p[0, i], dt, substeps)


@kernel("F2 (F F F) (F F F) F2w i8")
def to_body(x, rates, limits, table, first_row):
    """Write position, velocity, attitude and angular velocity to the body table.

    Args:
        x: State as in `advance_speed`, (8, n).
        rates: Commanded turn, pitch and roll rate [rad/s], (n,) each.
        limits: Limits of the rates [rad/s], (n,) each.
        table: Body table: position [m], velocity [m/s], quaternion body to world, angular velocity [rad/s], world frame, (>= 13, N);
            written.
        first_row: First row of the group in the table.
    """
    turn_rate, pitch_rate, roll_rate = rates
    turn_max, pitch_max, roll_max = limits
    body = table[:, first_row : first_row + x.shape[1]]
    for i in range(x.shape[1]):
        w, a, b, c, speed = x[3, i], x[4, i], x[5, i], x[6, i], x[7, i]
        fx, fy, fz = forward(w, a, b, c)
        body[0, i], body[1, i], body[2, i] = x[0, i], x[1, i], x[2, i]
        body[6, i], body[7, i], body[8, i], body[9, i] = w, a, b, c
        body[3, i], body[4, i], body[5, i] = speed * fx, speed * fy, speed * fz
        bank = clamp(roll_rate[i], roll_max[i])
        dive = -clamp(pitch_rate[i], pitch_max[i])
        turn = clamp(turn_rate[i], turn_max[i])
        body[10, i] = fx * bank + 2.0 * (a * b - w * c) * dive + 2.0 * (a * c + w * b) * turn
        body[11, i] = fy * bank + (1.0 - 2.0 * (a * a + c * c)) * dive + 2.0 * (b * c - w * a) * turn
        body[12, i] = fz * bank + 2.0 * (b * c + w * a) * dive + (1.0 - 2.0 * (a * a + b * b)) * turn
