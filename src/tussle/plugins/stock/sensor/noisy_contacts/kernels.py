"""Add noise to the states of contacts."""

from tussle.numeric.kernel import kernel
from tussle.numeric.quaternion import quat_conjugate, quat_from_euler, quat_multiply


@kernel("I (F2 F2 F2) (F2 F2 F2) (F2 F2 F2) (F2 F2 F2) F2w")
def blur(row, pos_noise, vel_noise, orient_noise, draws, contacts):
    """Add noise to the states of contacts.

    Args:
        row: Group row of the measuring entity, per contact, (m,).
        pos_noise: Mean and standard deviation of the error of x, y and z [m], (2, n) each, per row of the group.
        vel_noise: Mean and standard deviation of the velocity error [m/s], (2, n) each.
        orient_noise: Mean and standard deviation of the rotations about the body x, y and z axes, in this order [rad], (2, n) each.
        draws: Standard normal draws for position, velocity and rotations, (3, m) each.
        contacts: id, team, x y z [m], vx vy vz [m/s], qw qx qy qz, (12, m); true states, noise is added in place.
    """
    pos_0, pos_1, pos_2 = pos_noise
    vel_0, vel_1, vel_2 = vel_noise
    orient_0, orient_1, orient_2 = orient_noise
    pos_draw, vel_draw, orient_draw = draws
    for k in range(row.shape[0]):
        i = row[k]
        contacts[2, k] += pos_0[0, i] + pos_0[1, i] * pos_draw[0, k]
        contacts[3, k] += pos_1[0, i] + pos_1[1, i] * pos_draw[1, k]
        contacts[4, k] += pos_2[0, i] + pos_2[1, i] * pos_draw[2, k]
        contacts[5, k] += vel_0[0, i] + vel_0[1, i] * vel_draw[0, k]
        contacts[6, k] += vel_1[0, i] + vel_1[1, i] * vel_draw[1, k]
        contacts[7, k] += vel_2[0, i] + vel_2[1, i] * vel_draw[2, k]
        about_x = orient_0[0, i] + orient_0[1, i] * orient_draw[0, k]
        about_y = orient_1[0, i] + orient_1[1, i] * orient_draw[1, k]
        about_z = orient_2[0, i] + orient_2[1, i] * orient_draw[2, k]
        # Rx Ry Rz is the inverse of Rz(-) Ry(-) Rx(-), which quat_from_euler computes.
        bw, bx, by, bz = quat_from_euler(-about_x, -about_y, -about_z)
        tw, tx, ty, tz = quat_conjugate(bw, bx, by, bz)
        contacts[8, k], contacts[9, k], contacts[10, k], contacts[11, k] = quat_multiply(
            contacts[8, k], contacts[9, k], contacts[10, k], contacts[11, k], tw, tx, ty, tz
        )
