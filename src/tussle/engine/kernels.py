"""Kernels of who comes and goes: rows moved to other places, first states of the newborn."""

from __future__ import annotations

from tussle.numeric import cos, sin
from tussle.numeric.kernel import device, kernel
from tussle.numeric.quaternion import quat_from_euler
from tussle.rng import normal2, uniform2


@kernel("U u8 I i8 B F2 F2w")
def scatter(seeds, stream, place, attempt, flags, shape, pos):
    """Positions [m], (3, m), of entities around the position of their block.

    seeds, place: (m,) each, the place being that within the block. flags: whether places are uniform in a box, else normal; and
    whether the first entity is scattered too. shape: centre and half width, or standard deviation, (2, 3) [m].
    """
    is_uniform, scatter_first = flags[0], flags[1]
    for i in range(place.shape[0]):
        index = place[i]
        if attempt == 0 and index == 0 and not scatter_first:
            x, y, z = 0.0, 0.0, 0.0
        elif is_uniform:
            x, y = uniform2(seeds[i], stream, index, 0, attempt, 0)
            z, _ = uniform2(seeds[i], stream, index, 0, attempt, 1)
            x, y, z = 2.0 * x - 1.0, 2.0 * y - 1.0, 2.0 * z - 1.0
        else:
            x, y = normal2(seeds[i], stream, index, 0, attempt, 0)
            z, _ = normal2(seeds[i], stream, index, 0, attempt, 1)
        pos[0, i] = shape[0, 0] + x * shape[1, 0]
        pos[1, i] = shape[0, 1] + y * shape[1, 1]
        pos[2, i] = shape[0, 2] + z * shape[1, 2]


@kernel("U u8 I f8 F2 F2w F2w")
def turn(seeds, stream, place, heading_sd, motion, vel, quat):
    """Velocities [m/s], (3, m), and attitudes, (4, m), of heading, climb, roll [rad] and speed [m/s], (4, m)."""
    for i in range(place.shape[0]):
        jitter, _ = normal2(seeds[i], stream, place[i], 0, 0, 0)
        yaw = motion[0, i] + heading_sd * jitter
        climb, speed = motion[1, i], motion[3, i]
        quat[0, i], quat[1, i], quat[2, i], quat[3, i] = quat_from_euler(motion[2, i], -climb, yaw)
        vel[0, i] = speed * (cos(climb) * cos(yaw))
        vel[1, i] = speed * (cos(climb) * sin(yaw))
        vel[2, i] = speed * sin(climb)


@kernel("I Iw Iw Iw Iw")
def number(world, next_id, n_born, ids, places):
    """Give each newborn, (m,), of a block the next id of its world and the next place in the block; both count on."""
    for i in range(world.shape[0]):
        w = world[i]
        ids[i], places[i] = next_id[w], n_born[w]
        next_id[w] += 1
        n_born[w] += 1


@kernel("B i8 i8 (I I) (I I) I Iw -> i8")
def merge(gone, first, last, old, new, fresh, source):
    """Where the rows of a group come from: those of [first, last) that stay, and newborn j of `fresh` as -1 - j; how many there are.

    old, new: world and id of all rows, and of the newborn; both are in the order of (world, id) within a group, and so is source.
    """
    old_world, old_id = old
    new_world, new_id = new
    n = 0
    row = first
    for k in range(fresh.shape[0]):
        j = fresh[k]
        while row < last and (
            old_world[row] < new_world[j]
            or (old_world[row] == new_world[j] and (gone[row] or old_id[row] < new_id[j]))
        ):
            if not gone[row]:
                source[n] = row
                n += 1
            row += 1
        source[n] = -1 - j
        n += 1
    while row < last:
        if not gone[row]:
            source[n] = row
            n += 1
        row += 1
    return n


@kernel("I i8 i8 -> b1")
def stays(source, first, n):
    """Whether n rows from `first` on stay where they are, but for those that newborn ones replace."""
    if source.shape[0] != n:
        return False
    for i in range(n):
        if source[i] >= 0 and source[i] != first + i:
            return False
    return True


@device
def gather(table, first, fresh, source, out):
    """Columns source - first of table (k, n) into out (k, m), where source < 0 column -1 - source of fresh, or its only one.

    Rows that stay neighbours are copied as one piece.
    """
    k, m = table.shape[0], source.shape[0]
    last = fresh.shape[1] - 1
    j = 0
    while j < m:
        row, end = source[j], j + 1
        while row >= 0 and end < m and source[end] == source[end - 1] + 1:
            end += 1
        for r in range(k):
            if row >= 0:
                for i in range(end - j):
                    out[r, j + i] = table[r, row - first + i]
            else:
                out[r, j] = fresh[r, min(-1 - row, last)]
        j = end


@kernel("F2 i8 F2 I F2w")
def gather_floats(table, first, fresh, source, out):
    """See `gather`."""
    gather(table, first, fresh, source, out)


@kernel("I2 i8 I2 I I2w")
def gather_ints(table, first, fresh, source, out):
    """See `gather`."""
    gather(table, first, fresh, source, out)


@kernel("B2 i8 B2 I B2w")
def gather_truths(table, first, fresh, source, out):
    """See `gather`."""
    gather(table, first, fresh, source, out)
