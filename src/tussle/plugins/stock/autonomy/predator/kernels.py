"""Predator kernels: target choice, capture claims, and pure pursuit with unit gain."""

import math

import numpy as np

from tussle.numeric import atan2, wrap
from tussle.numeric.kernel import kernel
from tussle.numeric.neighbors.search import DIFFERENT, SAME, TABLE, in_range, nearest_places, table_of

FAR = 1e150
"""Speed that does not count [m/s]: its square would overflow."""


@kernel(f"(F F F F) (I I B B) (F2 f8) (Iw Iw Iw Iw Iw) (I I I I) i8 {TABLE} -> b1")
def hunt(points, options, motion, out, rows, first, arrays):
    """Choose targets and collect claims for the rows of a group that begins at row `first` of the table.

    A target is kept while it lives and switching is not allowed; else the nearest entity of prey_team is chosen (on ties the
    smaller id). Every entity of another team nearer than capture_range is claimed, and with between_steps those that come nearer within
    `dt`, if both move straight on.

    Args:
        points: x, y, z and capture_range [m], (n,) each, by row of the group.
        options: Own team, prey_team, allow_switching, whether the nearest prey is chosen in every step, and between_steps, (n,) each.
        motion: Velocities of the body table [m/s], (3, N), and duration of the step [s].
        out: target, the id of the prey or 0, (n,); target_row, its row of the body table or -1, (n,); claim_row, row of the group,
            and claim_place, row of the body table, per claim, as many as fit; count, their number, or a room if they do not fit, (1,);
            written.
        rows: id, world and place of each row of the body table; row of each place.
        first: First row of the group in the body table.
        arrays: Neighbour index, and team of each place.

    Returns:
        Whether there was room for all claims.
    """
    x, y, z, capture_range = points
    own_team, prey_team, allow_switching, between_steps = options
    vel, dt = motion
    target, target_row, claim_row, claim_place, count = out
    row_id, row_world, place, order = rows
    table = table_of(arrays)
    table_x, table_y, table_z = table[5], table[6], table[7]
    fastest = np.zeros(table[0].shape[0])
    for j in range(row_world.shape[0]):
        speed = math.sqrt(vel[0, j] * vel[0, j] + vel[1, j] * vel[1, j] + vel[2, j] * vel[2, j])
        w = row_world[j]
        if fastest[w] < speed < FAR:
            fastest[w] = speed
    best, ranks, places = np.empty(1), np.empty(1, np.int64), np.empty(1, np.int64)
    n_claims = np.int64(
        0
    )  # a plain 0 is a type of its own to Numba, which would compile `in_range` for it as well
    room = claim_row.shape[0]
    for i in range(x.shape[0]):
        row = first + i
        w = row_world[row]
        me = place[row]
        found = target_row[i]
        if found < 0 or allow_switching[i]:
            nearest_places(w, me, x[i], y[i], z[i], SAME, float(prey_team[i]), table, best, ranks, places, 1)
            found = order[places[0]] if places[0] >= 0 else -1
        target[i] = row_id[found] if found >= 0 else 0
        target_row[i] = found
        until = in_range(
            w,
            me,
            x[i],
            y[i],
            z[i],
            capture_range[i] + (2.0 + 1e-9) * dt * fastest[w] if between_steps[i] else capture_range[i],
            DIFFERENT,
            float(own_team[i]),
            table,
            claim_place,
            n_claims,
        )
        if until > room:
            count[0] = 2 * until
            return False
        for k in range(n_claims, until):
            p = claim_place[k]
            j = order[p]
            dx, dy, dz = table_x[p] - x[i], table_y[p] - y[i], table_z[p] - z[i]
            if not math.sqrt(dx * dx + dy * dy + dz * dz) < capture_range[i]:
                u, v, s = (
                    dt * (vel[0, j] - vel[0, row]),
                    dt * (vel[1, j] - vel[1, row]),
                    dt * (vel[2, j] - vel[2, row]),
                )
                square = u * u + v * v + s * s
                part = min(-(dx * u + dy * v + dz * s) / square, 1.0) if 0.0 < square < FAR * FAR else 0.0
                if not part > 0.0:
                    continue
                dx, dy, dz = dx + part * u, dy + part * v, dz + part * s
                if not math.sqrt(dx * dx + dy * dy + dz * dz) < capture_range[i]:
                    continue
            claim_row[n_claims] = i
            claim_place[n_claims] = j
            n_claims += 1
    count[0] = n_claims
    return True


@kernel("(F F F) (F F F F) F I F2 (Fw Fw Fw)")
def pursue(pos, quat, max_speed, target_row, table_pos, commands):
    """Command speed [m/s] and rates [rad/s] towards the target; rows without a target keep their last commands.

    Args:
        pos: Positions x, y, z [m], (n,) each.
        quat: Quaternion w, x, y, z, body to world, (n,) each.
        max_speed: Commanded speed [m/s], (n,).
        target_row: Row of the target in the body table, or -1, (n,).
        table_pos: Positions of the body table [m], (3, N).
        commands: Speed, turn rate and pitch rate, (n,) each, written.
    """
    x, y, z = pos
    qw, qx, qy, qz = quat
    table_x, table_y, table_z = table_pos[0], table_pos[1], table_pos[2]
    speed, turn_rate, pitch_rate = commands
    for i in range(x.shape[0]):
        row = target_row[i]
        if row >= 0:
            dx, dy, dz = table_x[row] - x[i], table_y[row] - y[i], table_z[row] - z[i]
            east = qw[i] * qw[i] + qx[i] * qx[i] - qy[i] * qy[i] - qz[i] * qz[i]
            north = 2.0 * (qw[i] * qz[i] + qx[i] * qy[i])
            up = 2.0 * (qx[i] * qz[i] - qw[i] * qy[i])
            climb = atan2(up, math.sqrt(east * east + north * north))
            speed[i] = max_speed[i]
            turn_rate[i] = wrap(atan2(dy, dx) - atan2(north, east))
            pitch_rate[i] = wrap(atan2(dz, math.sqrt(dx * dx + dy * dy)) - climb)


@kernel("F F F I F2 Fw Fw")
def point(x, y, max_speed, target_row, table_pos, heading, speed):
    """Command heading [rad] and speed [m/s] towards the target; rows without a target keep their last commands."""
    for i in range(x.shape[0]):
        row = target_row[i]
        if row >= 0:
            heading[i] = atan2(table_pos[1, row] - y[i], table_pos[0, row] - x[i])
            speed[i] = max_speed[i]
