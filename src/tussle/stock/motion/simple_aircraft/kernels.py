"""SimpleAircraft kernels: RK4 without repeated evaluations, and conversion to the body table.

Roll, pitch and speed have constant rates in a substep, so the second and third stage of RK4 see the same bank, elevation
and speed, and the last stage of one substep is the first of the next. This leaves eight of sixteen sine-cosine pairs per
substep. Rows are processed in blocks of scratch, with the substeps outside the loop over rows, because LLVM vectorises
only loops over few arrays.
"""

from __future__ import annotations

import numpy as np

from tussle.numeric import sincos, tan
from tussle.numeric.kernel import device, kernel

BLOCK = 64  # rows; the scratch of a block fits into the L1 cache
THROTTLE_MAX = 100.0
ACCELERATION = 0.2  # m/s^2 per unit of throttle


@device
def clamp(value, low, high):
    """Value clamped to [low, high]."""
    return min(max(value, low), high)


@device
def turn_rate(sine, cosine, speed, radius, slope, target):
    """Turn rate [rad/s] at a bank given by its sine and cosine: V tan(roll) / (radius + slope (V - target))."""
    return speed * sine / (cosine * (radius + slope * (speed - target)))


@device
def state_equation(roll, pitch, yaw, speed, throttle, roll_rate, pitch_rate, radius, slope, target):
    """(x', y', z' [m/s], roll', pitch', yaw' [rad/s], speed' [m/s^2]), the state equation of `advance` inside the limits."""
    sp, cp = sincos(pitch)
    sy, cy = sincos(yaw)
    turn = speed / (radius + slope * (speed - target)) * tan(roll)
    pull = ACCELERATION * clamp(throttle, -THROTTLE_MAX, THROTTLE_MAX)
    return speed * cp * cy, speed * cp * sy, speed * sp, roll_rate, pitch_rate, turn, pull


@device
def advance_clamped(value, rate, rate_max, h, limit):
    """Value after h at a rate clamped to rate_max; the result is clamped to [-limit, limit]."""
    return clamp(value + h * clamp(rate, -rate_max, rate_max), -limit, limit)


@device
def sincos_rows(angle, sine, cosine, n):
    """Sine and cosine of the first n angles."""
    for j in range(n):
        sine[j], cosine[j] = sincos(angle[j])


@kernel("F2w F2 F2 f8 i8")
def advance(x, u, p, dt, substeps):
    """Advance all rows, in place.

    If a substep would end beyond a limit of roll, pitch or speed, the rate is reduced so that it ends at the limit.

    Args:
        x: x, y, z [m], roll, pitch, yaw [rad], speed [m/s], (7, n), world frame; positive roll turns left,
            pitch nose up.
        u: throttle, roll_rate, pitch_rate [rad/s], (3, n).
        p: turning_radius [m], min_velocity, max_velocity [m/s], max_roll, max_pitch [rad], max_roll_rate,
            max_pitch_rate [rad/s], speed_target [m/s], radius_slope_per_speed [s], (9, n).
        dt: Duration [s].
        substeps: Number of equal RK4 steps in dt.
    """
    east, north, up, roll, pitch, yaw, speed = x[0], x[1], x[2], x[3], x[4], x[5], x[6]
    h = dt / substeps
    half_h, sixth_h = 0.5 * h, dt / substeps / 6.0
    # 0, m, 1: start, middle and end of the substep; "level" is the horizontal speed.
    rows = np.empty((9, BLOCK))
    v0, vm, v1, turn0, turn_m, turn1 = rows[0], rows[1], rows[2], rows[3], rows[4], rows[5]
    rise0, level0, level_m = rows[6], rows[7], rows[8]
    angle, sine, cosine = np.empty(4 * BLOCK), np.empty(4 * BLOCK), np.empty(4 * BLOCK)
    for first in range(0, x.shape[1], BLOCK):
        m = min(BLOCK, x.shape[1] - first)
        last = first + m
        throttle, roll_rate, pitch_rate = u[0, first:last], u[1, first:last], u[2, first:last]
        radius, speed_min, speed_max = p[0, first:last], p[1, first:last], p[2, first:last]
        roll_max, pitch_max, roll_rate_max = p[3, first:last], p[4, first:last], p[5, first:last]
        pitch_rate_max, target, slope = p[6, first:last], p[7, first:last], p[8, first:last]
        for l in range(m):
            angle[l] = roll[first + l]
            angle[m + l] = pitch[first + l]
        sincos_rows(angle, sine, cosine, 2 * m)
        for l in range(m):
            v0[l] = speed[first + l]
            rise0[l] = v0[l] * sine[m + l]
            level0[l] = v0[l] * cosine[m + l]
            turn0[l] = turn_rate(sine[l], cosine[l], v0[l], radius[l], slope[l], target[l])
        for _ in range(substeps):
            for l in range(m):
                angle[m + l] = advance_clamped(
                    roll[first + l], roll_rate[l], roll_rate_max[l], h, roll_max[l]
                )
                angle[l] = 0.5 * (roll[first + l] + angle[m + l])
                roll[first + l] = angle[m + l]
            for l in range(m):
                angle[3 * m + l] = advance_clamped(
                    pitch[first + l], pitch_rate[l], pitch_rate_max[l], h, pitch_max[l]
                )
                angle[2 * m + l] = 0.5 * (pitch[first + l] + angle[3 * m + l])
                pitch[first + l] = angle[3 * m + l]
            for l in range(m):
                pull = ACCELERATION * clamp(throttle[l], -THROTTLE_MAX, THROTTLE_MAX)
                v1[l] = clamp(v0[l] + h * pull, speed_min[l], speed_max[l])
                vm[l] = 0.5 * (v0[l] + v1[l])
            sincos_rows(angle, sine, cosine, 4 * m)
            for l in range(m):
                turn_m[l] = turn_rate(sine[l], cosine[l], vm[l], radius[l], slope[l], target[l])
                turn1[l] = turn_rate(sine[m + l], cosine[m + l], v1[l], radius[l], slope[l], target[l])
            for l in range(m):
                rise1 = v1[l] * sine[3 * m + l]
                up[first + l] += sixth_h * (rise0[l] + 4.0 * (vm[l] * sine[2 * m + l]) + rise1)
                rise0[l] = rise1
                level_m[l] = 2.0 * (vm[l] * cosine[2 * m + l])
                vm[l] = v1[l] * cosine[3 * m + l]  # from here on, vm holds the horizontal speed at the end
            for l in range(m):
                now = yaw[first + l]
                angle[l] = now
                angle[m + l] = now + half_h * turn0[l]
                angle[2 * m + l] = now + half_h * turn_m[l]
                angle[3 * m + l] = now + h * turn_m[l]
                yaw[first + l] = now + sixth_h * (turn0[l] + 4.0 * turn_m[l] + turn1[l])
            sincos_rows(angle, sine, cosine, 4 * m)
            for l in range(m):
                middle = level_m[l] * (cosine[m + l] + cosine[2 * m + l])
                east[first + l] += sixth_h * (level0[l] * cosine[l] + middle + vm[l] * cosine[3 * m + l])
            for l in range(m):
                middle = level_m[l] * (sine[m + l] + sine[2 * m + l])
                north[first + l] += sixth_h * (level0[l] * sine[l] + middle + vm[l] * sine[3 * m + l])
                v0[l], turn0[l], level0[l] = v1[l], turn1[l], vm[l]
        for l in range(m):
            speed[first + l] = v0[l]


@device
def effective(value, rate, rate_max, limit):
    """Effective rate [rad/s]: clamped to rate_max, and zero where the value is at its limit."""
    clamped = clamp(rate, -rate_max, rate_max)
    return 0.0 if (value >= limit and clamped > 0.0) or (value <= -limit and clamped < 0.0) else clamped


@kernel("F2 (F F) (F F F F) (F F F) F2w i8")
def to_body(x, rates, limits, circle, table, first_row):
    """Write position, attitude, velocity and angular velocity to the body table.

    Args:
        x: State as in `advance`, (7, n).
        rates: roll_rate, pitch_rate [rad/s], (n,) each.
        limits: max_roll, max_pitch [rad], max_roll_rate, max_pitch_rate [rad/s], (n,) each.
        circle: turning_radius [m], radius_slope_per_speed [s], speed_target [m/s], (n,) each.
        table: Body table: position [m], velocity [m/s], quaternion body to world, angular velocity [rad/s], world frame, (>= 13, N);
            written.
        first_row: First row of the group in the table.
    """
    roll_rate, pitch_rate = rates
    roll_max, pitch_max, roll_rate_max, pitch_rate_max = limits
    radius, slope, target = circle
    begin, end = first_row, first_row + x.shape[1]
    for k in range(3):
        for i in range(x.shape[1]):
            table[k, begin + i] = x[k, i]
    vx, vy, vz = table[3, begin:end], table[4, begin:end], table[5, begin:end]
    qw, qx, qy, qz = table[6, begin:end], table[7, begin:end], table[8, begin:end], table[9, begin:end]
    wx, wy, wz = table[10, begin:end], table[11, begin:end], table[12, begin:end]
    roll, pitch, yaw, speed = x[3], x[4], x[5], x[6]
    angle = np.empty(3 * BLOCK)
    sine = np.empty(3 * BLOCK)
    cosine = np.empty(3 * BLOCK)
    n = x.shape[1]
    for first in range(0, n, BLOCK):
        m = min(BLOCK, n - first)
        for l in range(m):
            i = first + l
            angle[l] = -0.5 * roll[i]
            angle[m + l] = -0.5 * pitch[i]
            angle[2 * m + l] = 0.5 * yaw[i]
        for j in range(3 * m):
            sine[j], cosine[j] = sincos(angle[j])
        for l in range(m):
            i = first + l
            sr, cr = sine[l], cosine[l]
            sp, cp = sine[m + l], cosine[m + l]
            sy, cy = sine[2 * m + l], cosine[2 * m + l]
            qw[i] = cr * (cp * cy) + sr * (sp * sy)
            qx[i] = sr * (cp * cy) - cr * (sp * sy)
            qy[i] = cr * (sp * cy) + sr * (cp * sy)
            qz[i] = cr * (cp * sy) - sr * (sp * cy)
        for l in range(m):
            i = first + l
            sp, cp = sine[m + l], cosine[m + l]
            sy, cy = sine[2 * m + l], cosine[2 * m + l]
            level = speed[i] * (cp * cp - sp * sp)
            vx[i] = level * (cy * cy - sy * sy)
            vy[i] = level * (2.0 * sy * cy)
            vz[i] = speed[i] * (-2.0 * sp * cp)
        for l in range(m):  # rotations about the vertical, the horizontal left axis and the body x axis
            i = first + l
            sr, cr = sine[l], cosine[l]
            sp, cp = (
                -2.0 * sine[m + l] * cosine[m + l],
                cosine[m + l] * cosine[m + l] - sine[m + l] * sine[m + l],
            )
            sy, cy = (
                2.0 * sine[2 * m + l] * cosine[2 * m + l],
                cosine[2 * m + l] * cosine[2 * m + l] - sine[2 * m + l] * sine[2 * m + l],
            )
            banked = -effective(roll[i], roll_rate[i], roll_rate_max[i], roll_max[i])
            lowered = -effective(pitch[i], pitch_rate[i], pitch_rate_max[i], pitch_max[i])
            turned = turn_rate(-2.0 * sr * cr, cr * cr - sr * sr, speed[i], radius[i], slope[i], target[i])
            wx[i] = banked * (cp * cy) - lowered * sy
            wy[i] = banked * (cp * sy) + lowered * cy
            wz[i] = banked * sp + turned
