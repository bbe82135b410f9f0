"""SimpleQuadrotor's law: RK4, which is Simpson's rule because the acceleration depends on time only."""

from tussle.numeric import sincos
from tussle.numeric.kernel import device
from tussle.numeric.paths import shortened


@device
def turned(forward, left, yaw):
    """World components of a vector in the frame that is turned by yaw [rad]."""
    sine, cosine = sincos(yaw)
    return forward * cosine - left * sine, forward * sine + left * cosine


@device
def flown(x, y, z, vx, vy, vz, yaw, yaw_rate, x_thrust, y_thrust, z_thrust, turn_force, max_vel, dt):
    """Law of the quadrotor: state and body after dt; names, units and frames are the plugin's."""
    middle = yaw + 0.5 * dt * (yaw_rate + 0.25 * dt * turn_force)
    yaw_1 = yaw + dt * (yaw_rate + 0.5 * dt * turn_force)
    ax_0, ay_0 = turned(x_thrust, y_thrust, yaw)
    ax_m, ay_m = turned(x_thrust, y_thrust, middle)
    ax_1, ay_1 = turned(x_thrust, y_thrust, yaw_1)
    sixth = dt / 6.0
    fx, fy = vx + sixth * (ax_0 + 4.0 * ax_m + ax_1), vy + sixth * (ay_0 + 4.0 * ay_m + ay_1)
    fz = vz + dt * z_thrust
    vx_1, vy_1, vz_1 = shortened(fx, fy, fz, max_vel)
    # A limited velocity loses its excess at a constant rate.
    px = x + dt * (vx + sixth * (ax_0 + 2.0 * ax_m) + 0.5 * (vx_1 - fx))
    py = y + dt * (vy + sixth * (ay_0 + 2.0 * ay_m) + 0.5 * (vy_1 - fy))
    pz = z + dt * 0.5 * (vz + vz_1)
    rate = yaw_rate + dt * turn_force
    pos, vel = (px, py, pz), (vx_1, vy_1, vz_1)
    return (*pos, *vel, yaw_1, rate), pos, vel, yaw_1, rate
