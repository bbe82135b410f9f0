"""DoubleIntegrator's law: exact for constant commands, except in the step in which the speed reaches its limit."""

from tussle.numeric import atan2
from tussle.numeric.kernel import device
from tussle.numeric.paths import clamp, shortened


@device
def turned(yaw, yaw_rate, turn_rate, rate_max, acceleration_max, dt):
    """Heading [rad] and yaw rate [rad/s] after dt: the rate goes to the command at the largest acceleration, then stays there."""
    change = clamp(turn_rate, -rate_max, rate_max) - yaw_rate
    reached = clamp(change, -acceleration_max * dt, acceleration_max * dt)
    ramp = dt if acceleration_max == 0.0 else min(abs(change) / acceleration_max, dt)
    return yaw + yaw_rate * dt + reached * (dt - 0.5 * ramp), yaw_rate + reached


@device
def flown(
    x, y, z, vx, vy, vz, yaw, yaw_rate, acceleration_x, acceleration_y, acceleration_z, turn_rate, max_vel, max_acc, max_yaw_vel,
    max_yaw_acc, motion_model_sets_yaw, dt,
):  # fmt: skip
    """Law of the point mass: state and body after dt; names, units and frames are the plugin's."""
    ax, ay, az = shortened(acceleration_x, acceleration_y, acceleration_z, max_acc)
    vx_1, vy_1, vz_1 = shortened(vx + dt * ax, vy + dt * ay, vz + dt * az, max_vel)
    half = 0.5 * dt
    pos = x + half * (vx + vx_1), y + half * (vy + vy_1), z + half * (vz + vz_1)
    yaw_1, rate_1 = turned(yaw, yaw_rate, turn_rate, max_yaw_vel, max_yaw_acc, dt)
    rests = (vx_1 == 0.0) & (vy_1 == 0.0)
    ahead = yaw if rests else atan2(vy_1, vx_1)
    yaw_1 = ahead if motion_model_sets_yaw else yaw_1
    vel = vx_1, vy_1, vz_1
    return (*pos, *vel, yaw_1, rate_1), pos, vel, yaw_1
