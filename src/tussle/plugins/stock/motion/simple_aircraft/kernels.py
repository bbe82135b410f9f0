"""SimpleAircraft's law, RK4 without repeated evaluations, and the output of the state to the body table.

Rows go through scratch arrays in blocks, because LLVM vectorises loops over few arrays only.
"""

import numpy as np

from tussle.numeric import sincos, wrap
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
def advance_clamped(value, rate, rate_max, h, limit):
    """Value after h at a rate clamped to rate_max; the result is clamped to [-limit, limit]."""
    return clamp(value + h * clamp(rate, -rate_max, rate_max), -limit, limit)


@device
def flown(
    x, y, z, roll, pitch, yaw, speed, throttle, roll_rate, pitch_rate, turning_radius, min_velocity, max_velocity, max_roll, max_pitch,
    max_roll_rate, max_pitch_rate, speed_target, radius_slope_per_speed, dt,
):  # fmt: skip
    """Law of the aircraft: state and body after one RK4 step of dt; names, units and frames are the plugin's.

    A rate that would end the step beyond a limit of roll, pitch or speed is lowered so that it ends on the limit. Roll, pitch and speed
    have constant rates then, so RK4's second and third stage see the same bank, elevation and speed.
    """
    radius, slope, target = turning_radius, radius_slope_per_speed, speed_target
    half, sixth = 0.5 * dt, dt / 6.0
    roll_1 = advance_clamped(roll, roll_rate, max_roll_rate, dt, max_roll)
    pitch_1 = advance_clamped(pitch, pitch_rate, max_pitch_rate, dt, max_pitch)
    pull = ACCELERATION * clamp(throttle, -THROTTLE_MAX, THROTTLE_MAX)
    speed_1 = clamp(speed + dt * pull, min_velocity, max_velocity)
    speed_m = 0.5 * (speed + speed_1)
    turn_0, turn_m, turn_1 = (
        turn_rate(*sincos(roll), speed, radius, slope, target),
        turn_rate(*sincos(0.5 * (roll + roll_1)), speed_m, radius, slope, target),
        turn_rate(*sincos(roll_1), speed_1, radius, slope, target),
    )
    sine_0, cosine_0 = sincos(pitch)
    sine_m, cosine_m = sincos(0.5 * (pitch + pitch_1))
    sine_1, cosine_1 = sincos(pitch_1)
    level_0, level_m, level_1 = speed * cosine_0, 2.0 * (speed_m * cosine_m), speed_1 * cosine_1
    up = speed * sine_0 + 4.0 * (speed_m * sine_m) + speed_1 * sine_1
    north_0, east_0 = sincos(yaw)
    north_1, east_1 = sincos(yaw + half * turn_0)
    north_2, east_2 = sincos(yaw + half * turn_m)
    north_3, east_3 = sincos(yaw + dt * turn_m)
    yaw_1 = yaw + sixth * (turn_0 + 4.0 * turn_m + turn_1)
    east = level_0 * east_0 + level_m * (east_1 + east_2) + level_1 * east_3
    north = level_0 * north_0 + level_m * (north_1 + north_2) + level_1 * north_3
    state = x + sixth * east, y + sixth * north, z + sixth * up, roll_1, pitch_1, yaw_1, speed_1
    sine, cosine = sincos(yaw_1)
    vel = level_1 * cosine, level_1 * sine, speed_1 * sine_1
    return state, state[2], vel, wrap(yaw_1), pitch_1, -roll_1


@device
def effective(value, rate, rate_max, limit):
    """Effective rate [rad/s]: clamped to rate_max, and zero where the value is at its limit."""
    clamped = clamp(rate, -rate_max, rate_max)
    return 0.0 if (value >= limit and clamped > 0.0) or (value <= -limit and clamped < 0.0) else clamped


@kernel("F2 (F F) (F F F F) (F F F) F2w i8")
def to_body(x, rates, limits, circle, table, first_row):
    """Write position, attitude, velocity and angular velocity to the body table.

    Args:
        x: x, y, z [m], roll (turns left), pitch (nose up), yaw [rad], speed [m/s], (7, n), world frame.
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
