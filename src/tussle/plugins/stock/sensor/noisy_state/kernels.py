"""Add noise to the state of a rigid body."""

from tussle.numeric.kernel import kernel
from tussle.numeric.quaternion import quat_conjugate, quat_from_euler, quat_multiply


@kernel("(F F F F F F F F F F) (F2 F2 F2) (F2 F2 F2) (F2 F2 F2) (F2 F2 F2) F2w F2w F2w")
def blur(truth, pos_noise, vel_noise, orient_noise, draws, pos, vel, quat):
    """Compute the true state plus mean plus standard deviation times a draw, component by component.

    Args:
        truth: Position [m], velocity [m/s], world frame, and quaternion body to world, ten (n,).
        pos_noise: Mean and standard deviation of the error of x, y and z [m], (2, n) each.
        vel_noise: Mean and standard deviation of the velocity error [m/s], (2, n) each.
        orient_noise: Mean and standard deviation of the rotations about the body x, y and z axes, in this order [rad], (2, n) each.
        draws: Standard normal draws for position, velocity and rotations, (3, n) each.
        pos: Noisy position [m], (3, n), world frame, written.
        vel: Noisy velocity [m/s], (3, n), world frame, written.
        quat: Noisy quaternion, body to world, (4, n), written.
    """
    x, y, z, vx, vy, vz, qw, qx, qy, qz = truth
    pos_0, pos_1, pos_2 = pos_noise
    vel_0, vel_1, vel_2 = vel_noise
    orient_0, orient_1, orient_2 = orient_noise
    pos_draw, vel_draw, orient_draw = draws
    for i in range(pos.shape[1]):
        pos[0, i] = x[i] + (pos_0[0, i] + pos_0[1, i] * pos_draw[0, i])
        pos[1, i] = y[i] + (pos_1[0, i] + pos_1[1, i] * pos_draw[1, i])
        pos[2, i] = z[i] + (pos_2[0, i] + pos_2[1, i] * pos_draw[2, i])
        vel[0, i] = vx[i] + (vel_0[0, i] + vel_0[1, i] * vel_draw[0, i])
        vel[1, i] = vy[i] + (vel_1[0, i] + vel_1[1, i] * vel_draw[1, i])
        vel[2, i] = vz[i] + (vel_2[0, i] + vel_2[1, i] * vel_draw[2, i])
        about_x = orient_0[0, i] + orient_0[1, i] * orient_draw[0, i]
        about_y = orient_1[0, i] + orient_1[1, i] * orient_draw[1, i]
        about_z = orient_2[0, i] + orient_2[1, i] * orient_draw[2, i]
        # Rx Ry Rz is the inverse of Rz(-) Ry(-) Rx(-), which quat_from_euler computes.
        bw, bx, by, bz = quat_from_euler(-about_x, -about_y, -about_z)
        tw, tx, ty, tz = quat_conjugate(bw, bx, by, bz)
        quat[0, i], quat[1, i], quat[2, i], quat[3, i] = quat_multiply(
            qw[i], qx[i], qy[i], qz[i], tw, tx, ty, tz
        )
