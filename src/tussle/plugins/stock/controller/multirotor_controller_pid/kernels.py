"""Velocity, attitude and rate loops of a multirotor, and the speeds of its rotors."""

import math

from tussle.numeric.kernel import device, kernel
from tussle.numeric.pid import pid_angle_loop, pid_loop
from tussle.numeric.quaternion import quat_rotate_inverse, quat_to_yaw
from tussle.numeric.rigid_body import add, cross, scale, times

STEEPEST = 0.7  # largest horizontal over vertical acceleration: a tilt of 35 degrees
RATE_GAIN = 20.0  # angular acceleration per error of a rate [1/s]


@device
def wanted_force(acceleration, gravity, mass):
    """Force [N], world frame, for an acceleration [m/s^2], whose horizontal part is limited by the tilt."""
    x, y, z = acceleration
    z = max(z + gravity, 0.1 * gravity)
    factor = min(1.0, STEEPEST * z / max(math.sqrt(x * x + y * y), 1e-9))
    return mass * factor * x, mass * factor * y, mass * z


@device
def wanted_torque(rates, omega, inertia):
    """Torque [N m] that brings the body rates omega to `rates` [rad/s]."""
    errors = rates[0] - omega[0], rates[1] - omega[1], rates[2] - omega[2]
    return add(scale(RATE_GAIN, times(inertia, errors)), cross(omega, times(inertia, omega)))


@kernel("(F2 F) (F F F F F F F F F F) (F2 F2 F2) (F F F2 F F) F2 F2w F2w f8")
def fly(wanted, body, gains, frame, mixer, loops, motors, dt):
    """Write the speeds of the rotors.

    Args:
        wanted: Velocity [m/s], (3, n), world frame, and heading [rad], (n,).
        body: Velocity [m/s], quaternion, angular velocity [rad/s], world frame, ten (n,).
        gains: kp, ki, kd, band of velocity, angle and heading, (4, n) each.
        frame: Gravity [m/s^2], mass [kg], inertia tensor (9, n), thrust and torque coefficients, (n,).
        mixer: Thrust of each rotor by total thrust, roll and pitch moment, and yaw moment over torque per thrust, (4 rotors, n).
        loops: Memory of the loops of velocity x, y, z, tilt about x and y, heading, (18, n); written.
        motors: Rotor speeds [rad/s], (rotors, n); written.
        dt: Time since the last call [s].
    """
    velocity, heading = wanted
    vx, vy, vz, qw, qx, qy, qz, wx, wy, wz = body
    vel_pid, angle_pid, yaw_pid = gains
    gravity, mass, inertia, c_t, c_q = frame
    for i in range(motors.shape[1]):
        tensor = (
            inertia[0, i], inertia[1, i], inertia[2, i], inertia[3, i], inertia[4, i], inertia[5, i], inertia[6, i], inertia[7, i],
            inertia[8, i],
        )  # fmt: skip
        w, x, y, z = qw[i], qx[i], qy[i], qz[i]
        vel_gains = vel_pid[0, i], vel_pid[1, i], vel_pid[2, i], vel_pid[3, i]
        angle_gains = angle_pid[0, i], angle_pid[1, i], angle_pid[2, i], angle_pid[3, i]
        yaw_gains = yaw_pid[0, i], yaw_pid[1, i], yaw_pid[2, i], yaw_pid[3, i]
        ax, kept_x = pid_loop(velocity[0, i] - vx[i], vel_gains, (loops[0, i], loops[1, i], loops[2, i]), dt)
        ay, kept_y = pid_loop(velocity[1, i] - vy[i], vel_gains, (loops[3, i], loops[4, i], loops[5, i]), dt)
        az, kept_z = pid_loop(velocity[2, i] - vz[i], vel_gains, (loops[6, i], loops[7, i], loops[8, i]), dt)
        fx, fy, fz = wanted_force((ax, ay, az), gravity[i], mass[i])
        size = math.sqrt(fx * fx + fy * fy + fz * fz)
        size = 1.0 if size == 0.0 else size
        bx, by, bz = quat_rotate_inverse(w, x, y, z, fx / size, fy / size, fz / size)
        p, kept_p = pid_loop(-by, angle_gains, (loops[9, i], loops[10, i], loops[11, i]), dt)
        q, kept_q = pid_loop(bx, angle_gains, (loops[12, i], loops[13, i], loops[14, i]), dt)
        r, kept_r = pid_angle_loop(
            heading[i] - quat_to_yaw(w, x, y, z), yaw_gains, (loops[15, i], loops[16, i], loops[17, i]), dt
        )
        rates = quat_rotate_inverse(w, x, y, z, wx[i], wy[i], wz[i])
        roll, pitch, yaw = wanted_torque((p, q, r), rates, tensor)
        thrust, yaw = size * max(bz, 0.0), yaw * c_t[i] / c_q[i]
        kept = (*kept_x, *kept_y, *kept_z, *kept_p, *kept_q, *kept_r)
        for k in range(18):
            loops[k, i] = kept[k]
        for k in range(motors.shape[0]):
            m = 4 * k
            lift = (
                mixer[m, i] * thrust
                + mixer[m + 1, i] * roll
                + mixer[m + 2, i] * pitch
                + mixer[m + 3, i] * yaw
            )
            motors[k, i] = math.sqrt(max(lift, 0.0) / c_t[i])
