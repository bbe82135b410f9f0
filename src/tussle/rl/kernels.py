"""Kernels of actions, observations and rewards: from rows of the body table to arrays (agents, numbers), and back.

An agent's number is world * agents per world + place in its world. A `spec` is kind and source of each feature, (n,), a row of the
table that it is taken from, and its numbers, (n, 4): scale, then for own features the point (x, y, z) [m] that is subtracted, for
those of others 1 where a vector is relative to the own one. Features are written side by side from a column on.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from tussle.numeric import atan2, exp, log
from tussle.numeric.kernel import kernel, lean_device
from tussle.numeric.neighbors.kernels import rank_bits
from tussle.numeric.neighbors.lane_count import LANES
from tussle.numeric.neighbors.lanes import bits, choose, load, lowest, splat, store
from tussle.numeric.neighbors.nearest_lanes import NONE, find_nearest
from tussle.numeric.neighbors.search import DIFFERENT, SAME, TABLE, in_range, nearest_places, table_of

SCALAR, PLANE, SPACE, DISTANCE, SAME_TEAM, PRESENT, FORWARD, DIRECTION = range(8)
"""Kinds of features: a number, a vector of two or three numbers, and what is known of a neighbour; the direction of the nose; the
direction of a neighbour."""
WORLD, HEADING, BODY = range(3)
"""Frames of vectors: the world's, turned by the heading, turned by the whole attitude."""
QUAT = 6
"""Row of the quaternion in the body table, behind position and velocity."""


@lean_device
def frame_of(floats, row, mode):
    """Rotation from the world to an entity's frame, its nine numbers by rows."""
    if mode == WORLD:
        return 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0
    w, x, y, z = floats[QUAT, row], floats[QUAT + 1, row], floats[QUAT + 2, row], floats[QUAT + 3, row]
    east, north = 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z)
    if mode == BODY:
        left = 2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)
        top = 2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)
        return east, north, 2.0 * (x * z - w * y), left[0], left[1], left[2], top[0], top[1], top[2]
    length = math.sqrt(east * east + north * north)
    if length > 0.0:
        east, north = east / length, north / length
    else:
        east, north = 1.0, 0.0
    return east, north, 0.0, -north, east, 0.0, 0.0, 0.0, 1.0


@lean_device
def put_vector(kind, scale, x, y, z, turn, a, column, out):
    """Write a vector of the world in the frame `turn`: two numbers if kind is PLANE, else three."""
    a = np.uint64(a)  # unsigned: without the test whether an index counts from the end
    out[a, np.uint64(column)] = scale * (turn[0] * x + turn[1] * y + turn[2] * z)
    out[a, np.uint64(column + 1)] = scale * (turn[3] * x + turn[4] * y + turn[5] * z)
    if kind != PLANE:
        out[a, np.uint64(column + 2)] = scale * (turn[6] * x + turn[7] * y + turn[8] * z)


@lean_device
def put_others(floats, team, row, near, n, spec, turn, a, column, width, out):
    """Write the features of near[:n], rows of the body table, for the entity `row`, `width` numbers for each; zeros for row -1."""
    kinds, source, numbers = spec
    for j in range(n):
        if near[j] < 0:
            out[a, column + j * width : column + (j + 1) * width] = 0.0
    for f in range(kinds.shape[0]):
        kind, k, scale = kinds[f], source[f], numbers[f, 0]
        is_vector = kind == PLANE or kind == SPACE
        x, y, z = 0.0, 0.0, 0.0
        if is_vector and numbers[f, 1] != 0.0:
            x, y, z = floats[k, row], floats[k + 1, row], floats[k + 2, row]
        for j in range(n):
            if near[j] < 0:
                continue
            other, at = np.uint64(near[j]), np.uint64(column + j * width)
            if is_vector:
                dx, dy, dz = floats[k, other] - x, floats[k + 1, other] - y, floats[k + 2, other] - z
                put_vector(kind, scale, dx, dy, dz, turn, a, at, out)
            elif kind == SCALAR:
                out[np.uint64(a), at] = scale * floats[k, other]
            elif kind == DISTANCE or kind == DIRECTION:
                dx, dy = floats[0, other] - floats[0, row], floats[1, other] - floats[1, row]
                dz = floats[2, other] - floats[2, row]
                length = math.sqrt(dx * dx + dy * dy + dz * dz)
                if kind == DISTANCE:
                    out[a, at] = scale * length
                else:
                    put_vector(SPACE, scale / max(length, 1e-9), dx, dy, dz, turn, a, at, out)
            else:
                out[np.uint64(a), at] = scale if kind == PRESENT or team[other] == team[row] else 0.0
        column += 2 if kind == PLANE else 3 if kind == SPACE or kind == DIRECTION else 1


def own(floats, table, shift, who, spec, mode, column, out):
    """Write features of the entities themselves.

    floats: body table (22, N). table: that of the features; row r of the body table is its column r - shift. who: rows of the body
    table, and agents, (m,) each. mode: frame of vectors. out: (agents, numbers), written from `column` on.
    """
    rows, agents = who
    kinds, source, numbers = spec
    for i in range(rows.shape[0]):
        row, a, at = rows[i], agents[i], column
        turn = frame_of(floats, row, mode)
        for f in range(kinds.shape[0]):
            kind, k, scale, j = kinds[f], source[f], numbers[f, 0], row - shift
            if kind == SCALAR:
                out[a, at] = scale * (table[k, j] - numbers[f, 1])
                at += 1
            elif kind == FORWARD:
                nose = frame_of(floats, row, BODY)
                put_vector(SPACE, scale, nose[0], nose[1], nose[2], turn, a, at, out)
                at += 3
            else:
                x, y = table[k, j] - numbers[f, 1], table[k + 1, j] - numbers[f, 2]
                z = table[k + 2, j] - numbers[f, 3]
                put_vector(kind, scale, x, y, z, turn, a, at, out)
                at += 2 if kind == PLANE else 3


def nearest(floats, who, wanted, blocks, index, spec, numbers, radius, part, out):
    """Write features of the k <= LANES nearest others within `radius` [m], nearest first; zeros for those that are missing.

    who: agent of each row from `first` on, or -1; `first`; team of all rows. wanted: team that is looked for, by row from `first` on.
    blocks: cuts, spans and points of `Blocks`. index: members, world of the strips, order, world_start, keys, points, team by place.
    numbers: k, mode of the teams, frame, first column, columns per neighbour. part: blocks [begin, end).
    """
    agent, first, team = who
    cuts, spans, points = blocks
    queries, block_first, block_strip, span_first, span_last = cuts[0], cuts[1], cuts[2], cuts[3], cuts[4]
    members, strip_world, order, world_start, keys, placed, place_team = index
    k, mode, frame, column, width = numbers
    candidates = queries, spans[0], spans[1], points
    table = world_start, keys, (placed[0], placed[1], placed[2]), place_team
    kept, teams, others = np.empty((LANES, LANES)), np.zeros(LANES), np.empty(k, np.int64)
    for b in range(part[0], part[1]):
        begin, end = block_first[b], block_first[b + 1]
        n_agents = 0
        for q in range(begin, end):
            own = order[queries[q]] - first
            teams[q - begin] = wanted[own]
            n_agents += agent[own] >= 0
        if n_agents == 0:
            continue
        w = strip_world[block_strip[b]]
        find_nearest(begin, (span_first[b], span_last[b]), w, candidates, table, mode, teams, radius, k, kept)
        start = world_start[w]
        rank = (1 << rank_bits(world_start[w + 1] - start)) - 1
        whole = kept.view(np.int64)
        for q in range(begin, end):
            row = order[queries[q]]
            a = agent[row - first]
            if a < 0:
                continue
            for j in range(k):
                is_there = kept[j, q - begin] < NONE
                others[j] = members[start + (whole[j, q - begin] & rank)] if is_there else -1
            turn = frame_of(floats, row, frame)
            put_others(floats, team, row, others, k, spec, turn, a, column, width, out)


def found(floats, who, team, near, spec, numbers, part, out):
    """Write features of others that have been found: near, (m, k or more), rows of the body table, or -1.

    numbers: k, frame, first column, columns per neighbour. part: agents [begin, end) of those in `who`.
    """
    rows, agents = who
    k, frame, column, width = numbers
    for i in range(part[0], part[1]):
        turn = frame_of(floats, rows[i], frame)
        put_others(floats, team, rows[i], near[i], k, spec, turn, agents[i], column, width, out)


def nearest_apart(floats, who, wanted, places, arrays, spec, numbers, radius, team, out):
    """Like `nearest` for any k and any number of candidates, one agent after another.

    wanted: team that is looked for, (m,). places: row_world, place, order of the index. arrays: its table. numbers: k, mode of the
    teams, frame, first column, columns per neighbour. team: team of all rows.
    """
    rows, agents = who
    row_world, place, order = places
    k, mode, frame, column, width = numbers
    table = table_of(arrays)
    best, ranks, others = np.empty(k), np.empty(k, np.int64), np.empty(k, np.int64)
    for i in range(rows.shape[0]):
        row = rows[i]
        me, x, y, z = place[row], floats[0, row], floats[1, row], floats[2, row]
        nearest_places(row_world[row], me, x, y, z, mode, wanted[i], table, best, ranks, others, k)
        for j in range(k):
            others[j] = order[others[j]] if best[j] < radius * radius else -1
        turn = frame_of(floats, row, frame)
        put_others(floats, team, row, others, k, spec, turn, agents[i], column, width, out)


def sectors(floats, who, wanted, places, arrays, numbers, radius, out):
    """Write 1 - distance / radius of the nearest other in each of n sectors of the horizontal plane, from the front to the left; else 0.

    numbers: n, mode of the teams, frame, first column. The others are those of `nearest`.
    """
    rows, agents = who
    row_world, place, order = places
    n, mode, frame, column = numbers
    table = table_of(arrays)
    found = np.empty(order.shape[0], np.int64)
    for i in range(rows.shape[0]):
        row, a = rows[i], agents[i]
        me, x, y, z = place[row], floats[0, row], floats[1, row], floats[2, row]
        m = in_range(row_world[row], me, x, y, z, radius, mode, wanted[i], table, found, 0)
        turn = frame_of(floats, row, frame)
        out[a, column : column + n] = 0.0
        for j in range(m):
            dx, dy, dz = table[5][found[j]] - x, table[6][found[j]] - y, table[7][found[j]] - z
            ahead = turn[0] * dx + turn[1] * dy + turn[2] * dz
            left = turn[3] * dx + turn[4] * dy + turn[5] * dz
            s = math.floor(atan2(left, ahead) * (n / (2.0 * math.pi)) + 0.5) % n
            near = 1.0 - math.sqrt(dx * dx + dy * dy + dz * dz) / radius
            out[a, column + s] = max(out[a, column + s], near)


def sums(floats, who, wanted, places, arrays, spec, numbers, radius, team, out):
    """Write the number of others within `radius` [m], divided by `unit`, and the means of their features; zeros without others.

    numbers: mode of the teams, frame, first column, columns of the features, `unit`. The rest is as in `nearest_apart`.
    """
    rows, agents = who
    row_world, place, order = places
    mode, frame, column, width, unit = numbers
    table = table_of(arrays)
    others = np.empty(order.shape[0], np.int64)
    features = np.empty((1, width * order.shape[0]))
    for i in range(rows.shape[0]):
        row, a = rows[i], agents[i]
        me, x, y, z = place[row], floats[0, row], floats[1, row], floats[2, row]
        if width == 0:
            out[a, column] = (
                in_range(row_world[row], me, x, y, z, radius, mode, wanted[i], table, others[:0], 0) / unit
            )
            continue
        m = in_range(row_world[row], me, x, y, z, radius, mode, wanted[i], table, others, 0)
        for j in range(m):
            others[j] = order[others[j]]
        turn = frame_of(floats, row, frame)
        put_others(floats, team, row, others, m, spec, turn, 0, 0, width, features)
        out[a, column] = m / unit
        for c in range(width):
            total = 0.0
            for j in range(m):
                total += features[0, j * width + c]
            out[a, column + 1 + c] = total / max(m, 1)


def each(floats, who, members, spec, numbers, out):
    """Write features of all entities of a block in order of their place in it, without the entity itself; zeros for those that are gone.

    members: body row of each (world, place in the block), or -1; world and team of all rows, (N,). numbers: frame, first column,
    columns per entity, most entities.
    """
    rows, agents = who
    of, world, team = members
    frame, column, width, most = numbers
    others = np.empty(of.shape[1], np.int64)
    for i in range(rows.shape[0]):
        row, n = rows[i], 0
        for j in range(of.shape[1]):
            if of[world[row], j] != row:
                others[n] = of[world[row], j]
                n += 1
        turn = frame_of(floats, row, frame)
        put_others(floats, team, row, others, min(n, most), spec, turn, agents[i], column, width, out)


ROWS = "F2 (I I)"
SPEC = "(I I F2)"
SEARCH = f"{ROWS} F (I I I) {TABLE}"
BLOCKS = "(I2 I2 F2) (I I I I I F2 F)"
# Those of observations are compiled for float32 and float64.
SIGNATURES: dict[Any, str] = {
    own: f"F2 F2 i8 (I I) {SPEC} i8 i8",
    nearest: f"F2 (I i8 I) F {BLOCKS} {SPEC} (i8 i8 i8 i8 i8) f8 (i8 i8)",
    found: f"F2 (I I) I I2 {SPEC} (i8 i8 i8 i8) (i8 i8)",
    nearest_apart: f"{SEARCH} {SPEC} (i8 i8 i8 i8 i8) f8 I",
    sectors: f"{SEARCH} (i8 i8 i8 i8) f8",
    sums: f"{SEARCH} {SPEC} (i8 i8 i8 i8 i8) f8 I",
    each: f"{ROWS} (I2 I I) {SPEC} (i8 i8 i8 i8)",
}


@kernel("F2 (I I) i8 i8 f8 f8 Fw -> i8")
def act(actions, who, first, column, low, high, channel):
    """Write a channel from actions, -1 to 1, clamped, to the range low to high. Returns the first agent whose action is NaN, or -1.

    actions: (agents, numbers). who: rows of the body table, and agents, (m,) each. first: row of the table that is channel[0].
    """
    row, place = who
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    for i in range(row.shape[0]):
        value = actions[place[i], column]
        if math.isnan(value):
            return place[i]
        channel[row[i] - first] = middle + half * min(max(value, -1.0), 1.0)
    return -1


@kernel("I2 I I -> i8")
def wrong_level(actions, place, sizes):
    """Return the first agent of `place`, (m,), with an action that is no level, or -1. sizes: number of levels of each action."""
    for i in range(place.shape[0]):
        for c in range(sizes.shape[0]):
            if not 0 <= actions[place[i], c] < sizes[c]:
                return place[i]
    return -1


@kernel("I2 (I I) i8 F Fw")
def choose_level(actions, who, column, values, channel):
    """Write the value of each agent's level to a channel. who: rows of the channel, and agents, (m,) each."""
    row, place = who
    for i in range(row.shape[0]):
        channel[row[i]] = values[min(actions[place[i], column], values.shape[0] - 1)]


@kernel("F2 I I F2w")
def take(table, row, place, out):
    """Write columns of the body table, (k, N), to agents: out, (agents, k)."""
    for i in range(row.shape[0]):
        for c in range(table.shape[0]):
            out[place[i], c] = table[c, row[i]]


def settle(out, was_alive):
    """Set a term of the reward of those that were dead to 0; all flat. Returns the first place that is not finite, or -1."""
    for i in range(out.shape[0]):
        if not was_alive[i]:
            out[i] = 0.0
        elif not math.isfinite(out[i]):
            return i
    return -1


SETTLE = {"float32": kernel("Sw B -> i8")(settle), "float64": kernel("Fw B -> i8")(settle)}
"""`settle` by type of the numbers."""


# -- searches that start from a guess ------------------------------------------------------------------------------------------------

GUESS = 1.1
"""Distance of the next search over that of the last k-th other."""
MAX_RANKED = 48
"""Candidates that are compared all with all, instead of inserted one after another."""


@lean_device
def put_key(key, item, n, keys, items):
    """Insert a key and its item into the sorted lists keys[:n] and items[:n]."""
    p = n
    while p > 0 and keys[p - 1] > key:
        keys[p], items[p] = keys[p - 1], items[p - 1]
        p -= 1
    keys[p], items[p] = key, item


@lean_device
def scan_world(me, x, y, z, radius, mode, wanted, table, start, end, found):
    """Write the places in [start, end) nearer than the radius, without `me`, to `found`; returns how many.

    It tests 64 places before it looks at the result: each look is a branch that the processor cannot predict.
    """
    sx, sy, sz, team = table[5], table[6], table[7], table[8]
    radius2, n = radius * radius, 0
    for first in range(start, end, 64):
        word = np.uint64(0)
        for p in range(first, min(first + 64, end), LANES):
            dx, dy, dz = load(sx, p) - x, load(sy, p) - y, load(sz, p) - z
            hit = dx * dx + dy * dy + dz * dz < radius2
            if mode == SAME:
                hit = hit & (load(team, p) == wanted)
            elif mode == DIFFERENT:
                hit = hit & (load(team, p) != wanted)
            word |= np.uint64(bits(hit)) << np.uint64(p - first)
        if end - first < 64:
            word &= (np.uint64(1) << np.uint64(end - first)) - np.uint64(1)
        if first <= me < first + 64:
            word &= ~(np.uint64(1) << np.uint64(me - first))
        while word != 0:
            found[n] = first + lowest(np.int64(word))
            word &= word - np.uint64(1)
            n += 1
    return n


@lean_device
def sort_keys(keys, items, n, k, places, sorted_keys, sorted_items):
    """Write the k smallest of n different keys, and their items, in order; the rest of the n places may be written, too."""
    if n > MAX_RANKED:
        for i in range(n):
            if i < k:
                put_key(keys[i], items[i], i, sorted_keys, sorted_items)
            elif keys[i] < sorted_keys[k - 1]:
                put_key(keys[i], items[i], k - 1, sorted_keys, sorted_items)
        return
    for first in range(0, n, LANES):
        mine, smaller = load(keys, first), splat(0.0)
        for j in range(n):
            smaller = smaller + choose(mine > keys[j], splat(1.0), splat(0.0))
        store(places, first, smaller)
    for i in range(n):
        at = np.uint64(places[i])
        sorted_keys[at], sorted_items[at] = keys[i], items[i]


@kernel(f"F2 (I I F) (I I I) {TABLE} (i8 i8 f8) Fw (i8 i8) I2w")
def find_from_guess(floats, who, places, arrays, numbers, guesses, part, near):
    """Write the rows of the k nearest others within a radius to near, (m, k), nearest first; -1 for those that are missing.

    who: rows, agents, and what each looks for, (m,). places, arrays: as in `kernels.nearest_apart`; a world is one cell of the index.
    numbers: k, mode of the teams, radius [m]. guesses: distance that is searched first by agent [m]; set for the next search. part:
    agents [begin, end) of those in `who`.
    """
    source, ids, wanted = who
    row_world, place, order = places
    k, mode, radius = numbers
    table = table_of(arrays)
    world_start, keys, sx, sy, sz = table[0], table[1], table[5], table[6], table[7]
    room = order.shape[0] + LANES
    other, sorted_rows = np.empty(room, np.int64), np.empty(room, np.int64)
    squares, ranks, sorted_keys = np.empty(room), np.empty(room), np.empty(room)
    whole = squares.view(np.int64)
    for i in range(part[0], part[1]):
        row, a = source[i], ids[i]
        w, me, x, y, z = row_world[row], place[row], floats[0, row], floats[1, row], floats[2, row]
        start, end = world_start[w], world_start[w + 1]
        shift = rank_bits(end - start)
        mask = (1 << shift) - 1
        reach = min(guesses[a], radius)
        n = scan_world(me, x, y, z, reach, mode, wanted[i], table, start, end, other)
        further = 1.5 * reach
        for _ in range(2):  # the guess of those without k others is infinite: one search finds that again
            if n < k and guesses[a] < radius:
                n = scan_world(me, x, y, z, min(further, radius), mode, wanted[i], table, start, end, other)
            further = radius
        for j in range(n):
            q = np.uint64(other[j])
            dx, dy, dz = x - sx[q], y - sy[q], z - sz[q]
            squares[j] = dx * dx + dy * dy + dz * dz
        for j in range(n):
            q = np.uint64(other[j])
            whole[j] = (whole[j] >> shift << shift) | (keys[q] & mask)
            other[j] = order[q]
        sort_keys(squares, other, n, k, ranks, sorted_keys, sorted_rows)
        for j in range(k):
            near[i, j] = sorted_rows[j] if j < n else -1
        guesses[a] = GUESS * math.sqrt(sorted_keys[k - 1]) + 1e-3 if n >= k else np.inf


# -- particles ------------------------------------------------------------------------------------------------------------------------

MARGIN, DAMPING = 1e-3, 0.25
"""Of particles: width of soft contacts [m], and share of the velocity that is lost in a step."""


@kernel("(F F) (F F F F F) (I I I) (F2 F F) (Fw Fw)")
def total_force(push, own, places, others, total):
    """Push [N] times strength, and the contact forces of all others, in order of id: a soft maximum of the penetration.

    own: x, y, strength, contact force [N/m], and the team whose members are passed through, (n,). others: positions by place, radius
    and team.
    """
    x, y, strength, stiffness, passed = own
    row_world, place, world_start = places
    points, radius, team = others
    for i in range(x.shape[0]):
        fx, fy = push[0][i] * strength[i], push[1][i] * strength[i]
        w, me = row_world[i], place[i]
        for p in range(world_start[w], world_start[w + 1]):
            dx, dy = x[i] - points[0, p], y[i] - points[1, p]
            reach = radius[me] + radius[p] + 50.0 * MARGIN  # beyond, the force is below 1e-20 N
            square = dx * dx + dy * dy
            if p != me and team[p] != passed[i] and 0.0 < square < reach * reach:
                distance = math.sqrt(square)
                depth = -(distance - (radius[me] + radius[p])) / MARGIN
                soft = (max(depth, 0.0) + log(1.0 + exp(-abs(depth)))) * MARGIN
                fx += stiffness[i] * dx / distance * soft
                fy += stiffness[i] * dy / distance * soft
        total[0][i], total[1][i] = fx, fy


@kernel("F2w F2 F2 f8 i8")
def slide(x, u, p, dt, substeps):
    """Positions advance by the old velocities, which are then damped, pushed [N] at mass 1, and limited to p [m/s]."""
    for _ in range(substeps):
        for i in range(x.shape[1]):
            x[0, i] += x[2, i] * dt
            x[1, i] += x[3, i] * dt
            vx, vy = x[2, i] * (1.0 - DAMPING) + u[0, i] * dt, x[3, i] * (1.0 - DAMPING) + u[1, i] * dt
            speed = math.sqrt(vx * vx + vy * vy)
            if speed > p[0, i]:
                vx, vy = vx / speed * p[0, i], vy / speed * p[0, i]
            x[2, i], x[3, i] = vx, vy


@kernel("F2w F2 F2 f8 i8")
def glide(x, u, p, dt, substeps):
    """Velocities are damped and pushed [N] at mass 1; positions advance by the new ones, and stay within p [m] of the centre."""
    for _ in range(substeps):
        for i in range(x.shape[1]):
            for c in range(2):
                x[2 + c, i] = x[2 + c, i] * (1.0 - DAMPING) + u[c, i] * dt
                x[c, i] = min(max(x[c, i] + x[2 + c, i] * dt, -p[0, i]), p[0, i])
