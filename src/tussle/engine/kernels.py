"""Kernels of births and removals: initial states of newborn entities, and moving of rows."""

import math

from tussle.numeric import cos, sin
from tussle.numeric.kernel import device, kernel
from tussle.numeric.quaternion import quat_from_euler
from tussle.numeric.rng import normal2, uniform2


@device
def drawn_place(seed, stream, index, attempt, flags, shape, k):
    """Return the position x, y, z [m] of entity number `index` of a block; flags and column k of shape as in `scatter`."""
    if attempt == 0 and index == 0 and not flags[1]:
        x, y, z = 0.0, 0.0, 0.0
    elif flags[0]:
        x, y = uniform2(seed, stream, index, 0, attempt, 0)
        z, _ = uniform2(seed, stream, index, 0, attempt, 1)
        x, y, z = 2.0 * x - 1.0, 2.0 * y - 1.0, 2.0 * z - 1.0
    else:
        x, y = normal2(seed, stream, index, 0, attempt, 0)
        z, _ = normal2(seed, stream, index, 0, attempt, 1)
    return shape[0, k] + x * shape[3, k], shape[1, k] + y * shape[4, k], shape[2, k] + z * shape[5, k]


@kernel("u8 u8 i8 i8 B F2 Fw")
def scatter(seed, stream, place, attempt, flags, shape, pos):
    """Draw the position [m], (3,), of an entity of a block.

    place: number of the entity in its block. flags: True for positions that are uniform in a box, False for normally distributed
    ones; True if the first entity is scattered too. shape: centre and half width or standard deviation [m], (6, 1).
    """
    pos[0], pos[1], pos[2] = drawn_place(seed, stream, place, attempt, flags, shape, 0)


@kernel("(U I) (u8 u8) B F2 F2 (Iw Iw) (Iw Iw F2w F2w F2w Fw Fw Fw) i8")
def place_newborn(worlds, keys, flags, shape, values, counts, out, first):
    """Set ids, positions, attitudes and velocities of the newborn entities, (m,), of a block.

    worlds: random key and world of each newborn. keys: of the streams of positions and headings.
    flags, shape: as in `scatter`, with a column for each newborn, (6, m), or one for all. values: heading, climb, roll [rad], speed
    [m/s], variance of the heading [rad^2], health, radius [m], mass [kg], (8, m) or (8, 1). counts: next id of each world, and number
    of entities of the block born so far; both are advanced. out: columns whose rows from `first` on are written: id, block index,
    position [m], velocity [m/s], (3, n), quaternion, (4, n), health, radius, mass.
    """
    seeds, world = worlds
    position, turning = keys
    next_id, n_born = counts
    ids, places, pos, vel, quat, health, radius, mass = out
    last, last_shape = values.shape[1] - 1, shape.shape[1] - 1
    for j in range(world.shape[0]):
        w, k, i = world[j], min(j, last), first + j
        ids[i], places[i] = next_id[w], n_born[w]
        next_id[w] += 1
        n_born[w] += 1
        seed = seeds[j]
        pos[0, i], pos[1, i], pos[2, i] = drawn_place(
            seed, position, places[i], 0, flags, shape, min(j, last_shape)
        )
        jitter, _ = normal2(seed, turning, places[i], 0, 0, 0)
        yaw = values[0, k] + math.sqrt(values[4, k]) * jitter
        climb, speed = values[1, k], values[3, k]
        quat[0, i], quat[1, i], quat[2, i], quat[3, i] = quat_from_euler(values[2, k], -climb, yaw)
        vel[0, i] = speed * (cos(climb) * cos(yaw))
        vel[1, i] = speed * (cos(climb) * sin(yaw))
        vel[2, i] = speed * sin(climb)
        health[i], radius[i], mass[i] = values[5, k], values[6, k], values[7, k]


@kernel("I I I B2w")
def mark_teams(world, team, teams, has_team):
    """Set has_team[w, k] if world w has a row of team teams[k]."""
    for i in range(world.shape[0]):
        if i > 0 and world[i] == world[i - 1] and team[i] == team[i - 1]:
            continue
        for k in range(teams.shape[0]):
            if team[i] == teams[k]:
                has_team[world[i], k] = True


@kernel("B i8 i8 (I I) (I I) I (Iw Iw) -> i8 b1")
def merge(gone, first, last, old, new, fresh, out):
    """Merge the remaining rows [first, last) of a group with its newborn, ordered by (world, id).

    gone: rows to remove. old, new: world and id of all rows, and of all newborn; both ordered by (world, id) within a group. fresh:
    the group's newborn. out: source of each merged row (a row, or -1 - j for newborn j), and the merged position of each newborn.
    Returns the number of merged rows, and whether all remaining rows keep their positions.
    """
    old_world, old_id = old
    new_world, new_id = new
    source, place = out
    n = 0
    row = first
    stays = True
    for k in range(fresh.shape[0]):
        j = fresh[k]
        while row < last and (
            old_world[row] < new_world[j]
            or (old_world[row] == new_world[j] and (gone[row] or old_id[row] < new_id[j]))
        ):
            if not gone[row]:
                stays = stays and row == first + n
                source[n] = row
                n += 1
            row += 1
        source[n] = -1 - j
        place[k] = n
        n += 1
    while row < last:
        if not gone[row]:
            stays = stays and row == first + n
            source[n] = row
            n += 1
        row += 1
    return n, stays and n == last - first


@device
def gather(table, first, fresh, source, out):
    """Copy columns source - first of table (k, n) to out (k, m); where source < 0, column -1 - source of fresh, or its only column."""
    last = fresh.shape[1] - 1
    for r in range(table.shape[0]):
        for j in range(source.shape[0]):
            row = source[j]
            if row >= 0:
                out[r, j] = table[r, row - first]
            else:
                out[r, j] = fresh[r, min(-1 - row, last)]


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
