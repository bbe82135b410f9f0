"""Noise on the states of contacts."""

from __future__ import annotations

from tussle.numeric.kernel import kernel
from tussle.numeric.quaternion import quat_conjugate, quat_from_euler, quat_multiply


@kernel("I I F2 F2 F2 I I F2 F2 F2 F2 F2 F2 F2 F2 F2 F2 F2 F2 F2w")
def blur(
    row, other, true_pos, true_vel, true_quat, ids, teams,
    pos_0, pos_1, pos_2, vel_0, vel_1, vel_2, orient_0, orient_1, orient_2,
    pos_draw, vel_draw, orient_draw, contacts,
):  # fmt: skip
    """Fill the contact lists.

    Args:
        row: Row of the group that measures, (m,).
        other: Row of the body table that is measured, (m,).
        true_pos: True positions of the body table [m], (3, N), world frame.
        true_vel: True velocities [m/s], (3, N), world frame.
        true_quat: True quaternions body to world, (4, N).
        ids: Ids of the body table, (N,).
        teams: Teams of the body table, (N,).
        pos_0, pos_1, pos_2: Mean and standard deviation of x, y, z [m], (2, n) each, n rows of the group.
        vel_0, vel_1, vel_2: Those of the velocity [m/s], (2, n) each.
        orient_0, orient_1, orient_2: Those of the turns about the body x, y and z axes, in this order [rad], (2, n)
            each.
        pos_draw, vel_draw, orient_draw: Standard normal draws, (3, m) each.
        contacts: id, team, x y z [m], vx vy vz [m/s], qw qx qy qz, (12, m), written.
    """
    for k in range(row.shape[0]):
        i = row[k]
        j = other[k]
        contacts[0, k] = ids[j]
        contacts[1, k] = teams[j]
        contacts[2, k] = true_pos[0, j] + (pos_0[0, i] + pos_0[1, i] * pos_draw[0, k])
        contacts[3, k] = true_pos[1, j] + (pos_1[0, i] + pos_1[1, i] * pos_draw[1, k])
        contacts[4, k] = true_pos[2, j] + (pos_2[0, i] + pos_2[1, i] * pos_draw[2, k])
        contacts[5, k] = true_vel[0, j] + (vel_0[0, i] + vel_0[1, i] * vel_draw[0, k])
        contacts[6, k] = true_vel[1, j] + (vel_1[0, i] + vel_1[1, i] * vel_draw[1, k])
        contacts[7, k] = true_vel[2, j] + (vel_2[0, i] + vel_2[1, i] * vel_draw[2, k])
        about_x = orient_0[0, i] + orient_0[1, i] * orient_draw[0, k]
        about_y = orient_1[0, i] + orient_1[1, i] * orient_draw[1, k]
        about_z = orient_2[0, i] + orient_2[1, i] * orient_draw[2, k]
        # Rx Ry Rz is the inverse of Rz(-) Ry(-) Rx(-), which quat_from_euler makes.
        bw, bx, by, bz = quat_from_euler(-about_x, -about_y, -about_z)
        tw, tx, ty, tz = quat_conjugate(bw, bx, by, bz)
        contacts[8, k], contacts[9, k], contacts[10, k], contacts[11, k] = quat_multiply(
            true_quat[0, j], true_quat[1, j], true_quat[2, j], true_quat[3, j], tw, tx, ty, tz
        )
