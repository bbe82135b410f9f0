"""Kernels of the views: attitudes, rows by id, checks."""

import math

from tussle.numeric import atan2
from tussle.numeric.kernel import device, kernel
from tussle.numeric.neighbors.kernels import row_of
from tussle.numeric.quaternion import quat_normalize, quat_rotate


@device
def yaw_of(w, x, y, z):
    """Heading of the body x axis, counter-clockwise from East [rad]; here and below, quaternions need not have unit length."""
    return atan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z)


@device
def climb_of(w, x, y, z):
    """Elevation of the body x axis, nose up positive [rad]."""
    east = w * w + x * x - y * y - z * z
    north = 2.0 * (w * z + x * y)
    return atan2(2.0 * (x * z - w * y), math.sqrt(east * east + north * north))


@device
def roll_of(w, x, y, z):
    """Bank about the body x axis, right wing down positive [rad]."""
    return atan2(2.0 * (w * x + y * z), w * w - x * x - y * y + z * z)


@device
def forward_of(w, x, y, z):
    """Unit vector along the body x axis, world frame."""
    scale = 1.0 / (w * w + x * x + y * y + z * z)
    return (
        (w * w + x * x - y * y - z * z) * scale, 2.0 * (w * z + x * y) * scale, 2.0 * (x * z - w * y) * scale,
    )  # fmt: skip


@kernel("F2 i8 i8 i8 Fw")
def yaw(quat, first, last, base, out):
    """Headings [rad] of the columns [first, last) of quaternions (4, n); here and below, that of column i is written to out[i - base]."""
    for i in range(first, last):
        out[i - base] = yaw_of(quat[0, i], quat[1, i], quat[2, i], quat[3, i])


@kernel("F2 i8 i8 i8 Fw")
def climb(quat, first, last, base, out):
    """Elevations of the body x axis [rad], (n,)."""
    for i in range(first, last):
        out[i - base] = climb_of(quat[0, i], quat[1, i], quat[2, i], quat[3, i])


@kernel("F2 i8 i8 i8 Fw")
def roll(quat, first, last, base, out):
    """Banks about the body x axis [rad], (n,)."""
    for i in range(first, last):
        out[i - base] = roll_of(quat[0, i], quat[1, i], quat[2, i], quat[3, i])


@kernel("F2 i8 i8 i8 F2w")
def forward(quat, first, last, base, out):
    """Unit vectors along the body x axis, world frame, (3, n)."""
    for i in range(first, last):
        place = i - base
        out[0, place], out[1, place], out[2, place] = forward_of(
            quat[0, i], quat[1, i], quat[2, i], quat[3, i]
        )


@device
def level(w, x, y, z):
    """Horizontal unit vector (east, north) of the heading; zero if the nose points straight up or down."""
    dx = w * w + x * x - y * y - z * z
    dy = 2.0 * (w * z + x * y)
    length = math.sqrt(dx * dx + dy * dy)
    scale = 1.0 / length if length > 0.0 else 0.0
    return dx * scale, dy * scale


@kernel("F2 i8 i8 i8 F2w")
def level_forward(quat, first, last, base, out):
    """Horizontal unit vector of the heading, (2, n)."""
    for i in range(first, last):
        out[0, i - base], out[1, i - base] = level(quat[0, i], quat[1, i], quat[2, i], quat[3, i])


@kernel("F2 i8 i8 I Fw Fw")
def level_forward_by_place(quat, first, last, place, east, north):
    """Write the horizontal unit vectors of the headings of rows [first, last) by place, (n,) each."""
    for i in range(first, last):
        p = place[i]
        east[p], north[p] = level(quat[0, i], quat[1, i], quat[2, i], quat[3, i])


@kernel("F i8 i8 I Fw")
def floats_by_place(values, first, last, place, out):
    """Set out[place[i]] = values[i] for the rows [first, last)."""
    for i in range(first, last):
        out[place[i]] = values[i]


@kernel("I i8 i8 I Fw")
def ints_by_place(values, first, last, place, out):
    """Set out[place[i]] = values[i] for the rows [first, last), as floats."""
    for i in range(first, last):
        out[place[i]] = values[i]


@kernel("I I Iw")
def count_ids(world, ids, id_start):
    """Set id_start[w] to the index of world w's id 0 in a table of all ids, and the last item to the table's length."""
    for i in range(world.shape[0]):
        w = world[i] + 1
        id_start[w] = max(id_start[w], ids[i] + 1)
    for w in range(1, id_start.shape[0]):
        id_start[w] += id_start[w - 1]


@kernel("I I I Iw Iw Iw")
def lay_out(world, ids, id_start, id_row, members, world_start):
    """Set the row of each id (id_row is -1 on entry) and the rows by (world, id)."""
    for i in range(world.shape[0]):
        id_row[id_start[world[i]] + ids[i]] = i
    n = 0
    for w in range(id_start.shape[0] - 1):
        world_start[w] = n
        for k in range(id_start[w], id_start[w + 1]):
            if id_row[k] >= 0:
                members[n] = id_row[k]
                n += 1
    world_start[id_start.shape[0] - 1] = n


@kernel("I I I I Iw")
def find_rows(world, ids, id_row, id_start, rows):
    """Set rows[i] to the row of (world[i], ids[i]); -1 for id 0 and for removed entities."""
    for i in range(world.shape[0]):
        rows[i] = row_of(world[i], ids[i], id_row, id_start)


@kernel("F I Fw -> f8")
def longest_reach(radius, world, reach):
    """Set reach[w], 0 on entry, to the largest radius of its rows [m]. Returns the value common to all worlds with rows, or -1."""
    n = radius.shape[0]
    same = 0
    while same < n and radius[same] == radius[0]:
        same += 1
    if same == n:
        return max(0.0, radius[0]) if n > 0 else 0.0
    for i in range(n):
        w = world[i]
        reach[w] = max(reach[w], radius[i])
    common = 0.0
    for w in range(reach.shape[0]):
        if reach[w] > 0.0 and common == 0.0:
            common = reach[w]
        if reach[w] > 0.0 and reach[w] != common:
            return -1.0
    return common


@kernel("F2 F2 F Bw (i8 i8) -> i8")
def check(pos, quat, health, faulty, part):
    """Count rows in [begin, end) that are faulty or have no health, and mark faulty rows: position or attitude not finite, or health NaN.

    The sum of the seven numbers minus itself is 0 only if all are finite: one test per row, which vectorises.
    """
    count = 0
    for i in range(part[0], part[1]):
        total = pos[0, i] + pos[1, i] + pos[2, i] + quat[0, i] + quat[1, i] + quat[2, i] + quat[3, i]
        bad = not (total - total == 0.0) or health[i] != health[i]
        faulty[i] = bad
        count += 1 if bad or not (health[i] > 0.0) else 0
    return count


@device
def columns_of_body(state):
    """Numbers of the body columns, pos, vel, quat, omega, yaw, climb, roll, forward, level_forward, of a rigid body's 13 numbers."""
    px, py, pz, vx, vy, vz, qw, qx, qy, qz, p, q, r = state
    w, x, y, z = quat_normalize(qw, qx, qy, qz)
    spin_x, spin_y, spin_z = quat_rotate(w, x, y, z, p, q, r)
    forward_x, forward_y, forward_z = forward_of(w, x, y, z)
    east, north = level(w, x, y, z)
    return (
        px, py, pz, vx, vy, vz, w, x, y, z, spin_x, spin_y, spin_z, yaw_of(w, x, y, z), climb_of(w, x, y, z),
        roll_of(w, x, y, z), forward_x, forward_y, forward_z, east, north,
    )  # fmt: skip


@kernel("F2 F2w i8")
def write_rigid_bodies(state, table, first):
    """Write rigid bodies to the body table.

    Args:
        state: Position [m], velocity [m/s], quaternion body to world, angular velocity [rad/s] in the body frame, (13, n).
        table: Body table, with angular velocity in the world frame, (>= 13, N); written.
        first: First row of the bodies in the table.
    """
    for i in range(state.shape[1]):
        row = first + i
        for k in range(6):
            table[k, row] = state[k, i]
        w, x, y, z = quat_normalize(state[6, i], state[7, i], state[8, i], state[9, i])
        table[6, row], table[7, row], table[8, row], table[9, row] = w, x, y, z
        table[10, row], table[11, row], table[12, row] = quat_rotate(
            w, x, y, z, state[10, i], state[11, i], state[12, i]
        )
