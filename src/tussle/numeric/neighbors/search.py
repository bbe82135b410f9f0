"""Kernels of range and nearest-neighbour queries. The query position may differ from that in the table, e.g. an estimate.

A `table` is the tuple (world_start, keys, strip_start, world_strip, inverse_cell, sx, sy, sz, team) of an index, with `team` by
place as float64. A team filter is a mode, ANY, SAME or DIFFERENT, and the team number `wanted`. A place is an entity's position
in the sorted order of the index, `me` the place of the querying entity.
"""

import math

import numpy as np

from tussle.numeric.kernel import device, kernel, lean_device
from tussle.numeric.neighbors.kernels import KEY_BITS, cell_of, lower_bound, rank_bits
from tussle.numeric.neighbors.lane_count import LANES
from tussle.numeric.neighbors.lanes import below, bits, choose, lane_of, load, lowest, ones, splat

ANY, SAME, DIFFERENT = 0, 1, 2

TABLE = "(I I I2 I F F2 F)"
"""Signature of the arrays of a table: `Index.table`, then team by place."""


@device
def table_of(arrays):
    """Table of the arrays passed to a kernel."""
    world_start, keys, strips, world_strip, inverse_cell, points, team = arrays
    return world_start, keys, strips[0], world_strip, inverse_cell, points[0], points[1], points[2], team


SMALL_WORLD = 3000
"""Up to this many entities, a nearest-neighbour query scans all of them: 8 at a time, 0.25 ns each."""

TINY_WORLD = 400
"""Up to this many entities, a branch-free pass first finds the smallest distance, then a second pass finds its entity."""

ROUNDING_CELLS = 1e-6
"""Bound of the rounding error of pos / cell, in cells: positions reach 2^30 cells at 53 bits."""


@lean_device
def squares(sx, sy, sz, p, x, y, z):
    """Squared distances of places p to p + 7 from a point."""
    dx = load(sx, p) - x
    dy = load(sy, p) - y
    dz = load(sz, p) - z
    return dx * dx + dy * dy + dz * dz


@lean_device
def chosen(hit, team, p, mode, wanted):
    """Bits of `hit` whose team passes the filter."""
    if mode == ANY:
        return hit
    same = bits(load(team, p) == wanted)
    return hit & same if mode == SAME else hit & ~same


@lean_device
def range_run(me, x, y, z, radius2, mode, wanted, table, start, end, found, done):
    """Append the places in [start, end) nearer than the radius to `found`, up to its size; an empty `found` only counts.

    Returns the number found so far, starting from `done`.
    """
    sx, sy, sz, team = table[5], table[6], table[7], table[8]
    for p in range(start, end, LANES):
        hit = bits(squares(sx, sy, sz, p, x, y, z) < radius2) & ((1 << min(LANES, end - p)) - 1)
        if hit != 0:
            hit = chosen(hit, team, p, mode, wanted)
            if found.shape[0] == 0:
                hit &= ~(1 << (me - p)) if p <= me < p + LANES else hit
                done += ones(hit)
                continue
            while hit != 0:
                q = p + lowest(hit)
                hit &= hit - 1
                if q != me:
                    if done < found.shape[0]:
                        found[done] = q
                    done += 1
    return done


@lean_device
def first_strip(keys, strip_start, start, end, shift, row):
    """First of the strips [start, end) whose cell row is at least `row`."""
    while start < end:
        middle = (start + end) >> 1
        if keys[strip_start[middle]] >> shift < row:
            start = middle + 1
        else:
            end = middle
    return start


@lean_device
def in_range(w, me, x, y, z, radius, mode, wanted, table, found, done):
    """Append the places of world w nearer than `radius` to (x, y, z), without `me`, to `found` in order; see `range_run`."""
    world_start, keys, strip_start, world_strip, inverse_cell = (
        table[0],
        table[1],
        table[2],
        table[3],
        table[4],
    )
    start = world_start[w]
    end = world_start[w + 1]
    inverse = inverse_cell[w]
    radius2 = radius * radius
    if not radius > 0.0:
        return done
    if inverse == 0.0 or end - start <= 2 * LANES:
        return range_run(me, x, y, z, radius2, mode, wanted, table, start, end, found, done)
    n_bits = rank_bits(end - start)
    cell_bits = (KEY_BITS - n_bits) >> 1
    shift = n_bits + cell_bits
    limit = float((1 << (cell_bits - 1)) - 1)
    high_row = cell_of(y + radius, inverse, limit)
    low = cell_of(x - radius, inverse, limit)
    high = cell_of(x + radius, inverse, limit) + 1
    last = world_strip[w + 1]
    strip = first_strip(keys, strip_start, world_strip[w], last, shift, cell_of(y - radius, inverse, limit))
    while strip < last:
        row = keys[strip_start[strip]] >> shift
        if row > high_row:
            break
        stop = strip_start[strip + 1]
        i = lower_bound(keys, strip_start[strip], stop, ((row << cell_bits) + low) << n_bits)
        j = lower_bound(keys, i, stop, ((row << cell_bits) + high) << n_bits)
        done = range_run(me, x, y, z, radius2, mode, wanted, table, i, j, found, done)
        strip += 1
    return done


@lean_device
def insert(square, rank, place, best, ranks, places, k):
    """Insert a candidate into the k best by (squared distance, rank). Returns the squared distance that later ones must not exceed."""
    if square > best[k - 1] or (square == best[k - 1] and rank > ranks[k - 1]):
        return best[k - 1]
    j = k - 1
    while j > 0 and (best[j - 1] > square or (best[j - 1] == square and ranks[j - 1] > rank)):
        best[j] = best[j - 1]
        ranks[j] = ranks[j - 1]
        places[j] = places[j - 1]
        j -= 1
    best[j] = square
    ranks[j] = rank
    places[j] = place
    return best[k - 1]


@lean_device
def nearest_run(me, x, y, z, mode, wanted, table, mask, start, end, worst, best, ranks, places, k):
    """Insert the places in [start, end) into the k best. Returns the squared distance that later ones must not exceed."""
    keys, sx, sy, sz, team = table[1], table[5], table[6], table[7], table[8]
    for p in range(start, end, LANES):
        hit = bits(squares(sx, sy, sz, p, x, y, z) <= worst) & ((1 << min(LANES, end - p)) - 1)
        if hit != 0:
            hit = chosen(hit, team, p, mode, wanted)
            while hit != 0:
                q = p + lowest(hit)
                hit &= hit - 1
                if q != me:
                    dx, dy, dz = sx[q] - x, sy[q] - y, sz[q] - z
                    worst = insert(dx * dx + dy * dy + dz * dz, keys[q] & mask, q, best, ranks, places, k)
    return worst


@lean_device
def least_square(x, y, z, mode, wanted, table, start, end, least):
    """Smallest squared distance per lane among `least` and the places in [start, end) that pass the filter."""
    sx, sy, sz, team = table[5], table[6], table[7], table[8]
    for p in range(start, end, LANES):
        square = squares(sx, sy, sz, p, x, y, z)
        nearer = (square < least) & below(end - p)
        if mode == SAME:
            nearer = nearer & (load(team, p) == wanted)
        elif mode == DIFFERENT:
            nearer = nearer & (load(team, p) != wanted)
        least = choose(nearer, square, least)
    return least


@lean_device
def too_far(cells, cell, worst):
    """Return True if everything `cells` cells away is farther than sqrt(worst) for any rounding error."""
    gap = (cells - 1.0 - ROUNDING_CELLS) * cell
    return gap > 0.0 and gap * gap * (1.0 - 1e-12) > worst


@lean_device
def nearest_in_strip(me, x, y, z, own, mode, wanted, table, shape, start, end, worst, best, ranks, places, k):
    """Search a strip outward from cell `own`, LANES places at a time, until the cells are too far."""
    n_bits, cell_bits, cell = shape
    keys = table[1]
    mask = (1 << n_bits) - 1
    cells = (1 << cell_bits) - 1
    row = keys[start] >> (n_bits + cell_bits)
    middle = lower_bound(keys, start, end, ((row << cell_bits) + own) << n_bits)
    p = middle
    while p < end and not too_far(float(((keys[p] >> n_bits) & cells) - own), cell, worst):
        stop = min(p + LANES, end)
        worst = nearest_run(me, x, y, z, mode, wanted, table, mask, p, stop, worst, best, ranks, places, k)
        p = stop
    p = middle
    while p > start and not too_far(float(own - ((keys[p - 1] >> n_bits) & cells)), cell, worst):
        begin = max(p - LANES, start)
        worst = nearest_run(me, x, y, z, mode, wanted, table, mask, begin, p, worst, best, ranks, places, k)
        p = begin
    return worst


@lean_device
def nearest_places(w, me, x, y, z, mode, wanted, table, best, ranks, places, k):
    """Write the k nearest places of world w by (squared distance, rank) to `best`, `ranks`, `places`; -1 if there are fewer."""
    world_start, keys, strip_start, world_strip, inverse_cell = (
        table[0],
        table[1],
        table[2],
        table[3],
        table[4],
    )
    for j in range(k):
        best[j] = np.inf
        ranks[j] = 1 << KEY_BITS
        places[j] = -1
    start = world_start[w]
    end = world_start[w + 1]
    inverse = inverse_cell[w]
    n_bits = rank_bits(end - start)
    worst = np.inf
    if inverse == 0.0 or end - start <= SMALL_WORLD:
        # Places next to `me` in the order are usually near: searching from there first rejects most of the others quickly.
        mask = (1 << n_bits) - 1
        begin = max(me - LANES // 2, start)
        if k == 1 and end - start <= TINY_WORLD:
            least = least_square(x, y, z, mode, wanted, table, start, me, splat(np.inf))
            least = least_square(x, y, z, mode, wanted, table, me + 1, end, least)
            for lane in range(LANES):
                worst = min(worst, lane_of(least, lane))
        worst = nearest_run(me, x, y, z, mode, wanted, table, mask, begin, end, worst, best, ranks, places, k)
        nearest_run(me, x, y, z, mode, wanted, table, mask, start, begin, worst, best, ranks, places, k)
        return
    cell_bits = (KEY_BITS - n_bits) >> 1
    limit = float((1 << (cell_bits - 1)) - 1)
    shape = (n_bits, cell_bits, 1.0 / inverse)
    shift = n_bits + cell_bits
    row = cell_of(y, inverse, limit)
    own = cell_of(x, inverse, limit)
    up = first_strip(keys, strip_start, world_strip[w], world_strip[w + 1], shift, row)
    down = up - 1
    while True:
        above = float((keys[strip_start[up]] >> shift) - row) if up < world_strip[w + 1] else np.inf
        below = float(row - (keys[strip_start[down]] >> shift)) if down >= world_strip[w] else np.inf
        if min(above, below) == np.inf or too_far(min(above, below), shape[2], worst):
            return
        strip = up if above <= below else down
        worst = nearest_in_strip(
            me,
            x,
            y,
            z,
            own,
            mode,
            wanted,
            table,
            shape,
            strip_start[strip],
            strip_start[strip + 1],
            worst,
            best,
            ranks,
            places,
            k,
        )
        if strip == up:
            up += 1
        else:
            down -= 1


@kernel(f"(F F F F F) i8 (I I) i8 {TABLE} I (Iw Iw) -> i8")
def pair_places(queries, mode, places, first, arrays, start, out):
    """Find the places near each row of a group that begins at row `first` of the table. Returns the number of pairs.

    queries: x, y, z, radius [m], wanted team, (n,) each. places: row_world, place (N,). out, written: count (n,) and found, the
    places of row i from start[i] on; an empty `found` only counts.
    """
    x, y, z, radius, wanted = queries
    row_world, place = places
    count, found = out
    table = table_of(arrays)
    total = 0
    for i in range(x.shape[0]):
        row = first + i
        w = row_world[row]
        into = found[start[i] :] if found.shape[0] > 0 else found
        count[i] = in_range(w, place[row], x[i], y[i], z[i], radius[i], mode, wanted[i], table, into, 0)
        total += count[i]
    return total


@kernel("(F F F) I I F2 I (Iw Iw) F2w Fw")
def pair_columns(pos, start, found, points, order, rows, offset, distance):
    """Columns of the pairs: rows in the group and in the table, offset [m] (3, m), distance [m] (m,)."""
    x, y, z = pos
    sx, sy, sz = points[0], points[1], points[2]
    row, other = rows
    for i in range(x.shape[0]):
        for k in range(start[i], start[i + 1]):
            p = found[k]
            dx, dy, dz = sx[p] - x[i], sy[p] - y[i], sz[p] - z[i]
            row[k] = i
            other[k] = order[p]
            offset[0, k] = dx
            offset[1, k] = dy
            offset[2, k] = dz
            distance[k] = math.sqrt(dx * dx + dy * dy + dz * dz)


@kernel(f"(F F F F) i8 i8 (I I I) i8 {TABLE} I2w F2w")
def nearest_rows(queries, k, mode, places, first, arrays, other, square):
    """Find the k nearest entities of each row of a group that begins at row `first` of the table.

    queries: x, y, z [m], wanted team, (n,) each. places: row_world, place, order (N,). Written: other, rows of the table or -1,
    and their squared distances [m^2], (k, n) each.
    """
    x, y, z, wanted = queries
    row_world, place, order = places
    table = table_of(arrays)
    best, ranks, found = np.empty(k), np.empty(k, np.int64), np.empty(k, np.int64)
    for i in range(x.shape[0]):
        row = first + i
        nearest_places(
            row_world[row], place[row], x[i], y[i], z[i], mode, wanted[i], table, best, ranks, found, k
        )
        for j in range(k):
            other[j, i] = order[found[j]] if found[j] >= 0 else -1
            square[j, i] = best[j]
