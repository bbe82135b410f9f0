"""Kernels of the index: sorting entities into cells, and blocks of queries with their candidates.

A key packs (cell row, cell, rank) of an entity into 63 bits; the rank is its index in its world's list by id. Keys of a world
are distinct, so their sorted order does not depend on the order before. Cells are floor(pos / cell) in absolute coordinates.
Cells outside the range of the bits are clamped to the outermost cell, which is correct but less selective.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from tussle.numeric.kernel import device, kernel
from tussle.numeric.neighbors.lane_count import LANES
from tussle.numeric.neighbors.sort import MOVES_PER_KEY, insertion_sort, sort_keys

KEY_BITS = 62


@device
def rank_bits(n: int) -> int:
    """Number of bits for the ranks of a world of n entities."""
    bits = 1
    while (1 << bits) < n:
        bits += 1
    return bits


@device
def row_of(world, entity, id_row, id_start):
    """Table row of an entity by its id; -1 if no entity of its world has this id."""
    first = id_start[world]
    return id_row[first + entity] if 0 < entity < id_start[world + 1] - first else -1


@device
def cell_of(position, inverse_cell, limit):
    """Cell number in [0, 2 limit], monotonic in position; 0 for NaN."""
    cell = math.floor(position * inverse_cell)
    cell = cell if cell > -limit else -limit
    cell = cell if cell < limit else limit
    return int(cell + limit)


@kernel("(I I) (I I Iw) (Iw Iw Iw Iw) (Iw Iw) i8")
def arrange(rows, old, new, work, n_worlds):
    """List the rows of each world by id, and keep the last sorted order.

    rows: world and id of each row of the new table, (N,). old: old_start (n_worlds + 1,), old_ids (old N,) by rank, keys (old N,)
    sorted. new, written: world_start (n_worlds + 1,), members (N,) rows by rank, ids (N,) by rank, fresh (N,) keys that hold only
    the rank, in the old order, followed by new rows. work: scratch (N,), sequence (max(N, old N),).
    """
    row_world, row_id = rows
    old_start, old_ids, keys = old
    world_start, members, ids, fresh = new
    scratch, sequence = work
    n = row_world.shape[0]
    world_start[:] = 0
    for row in range(n):
        world_start[row_world[row] + 1] += 1
    for w in range(n_worlds):
        world_start[w + 1] += world_start[w]
        sequence[w] = world_start[w]
    for row in range(n):
        w = row_world[row]
        members[sequence[w]] = (row_id[row] << 32) | row
        sequence[w] += 1
    for w in range(n_worlds):
        sort_keys(members, scratch, world_start[w], world_start[w + 1])
    for k in range(n):
        ids[k] = members[k] >> 32
        members[k] &= 0xFFFFFFFF
    for w in range(n_worlds):
        start = world_start[w]
        count = world_start[w + 1] - start
        first = old_start[w]
        n_old = old_start[w + 1] - first
        new = 0
        for k in range(n_old):
            while new < count and ids[start + new] < old_ids[first + k]:
                new += 1
            stays = new < count and ids[start + new] == old_ids[first + k]
            sequence[k] = new if stays else -1
        mask = (1 << rank_bits(n_old)) - 1
        for rank in range(count):
            scratch[start + rank] = 0
        done = start
        for k in range(n_old):
            rank = sequence[keys[first + k] & mask]
            if rank >= 0:
                fresh[done] = rank
                scratch[start + rank] = 1
                done += 1
        for rank in range(count):
            if scratch[start + rank] == 0:
                fresh[done] = rank
                done += 1


@device
def make_keys(pos, inverse_cell, worlds, keys, begin, end):
    """Set the keys of the places [begin, end); on entry, their low bits hold the ranks."""
    x, y = pos[0], pos[1]
    world_start, members = worlds
    for w in range(world_start.shape[0] - 1):
        start, stop = world_start[w], world_start[w + 1]
        inverse = inverse_cell[w]
        bits = rank_bits(stop - start)
        mask = (1 << bits) - 1
        cell_bits = (KEY_BITS - bits) >> 1
        limit = float((1 << (cell_bits - 1)) - 1)
        for p in range(max(start, begin), min(stop, end)):
            if inverse == 0.0:
                keys[p] = p - start
            else:
                rank = keys[p] & mask
                row = members[start + rank]
                cell = (cell_of(y[row], inverse, limit) << cell_bits) | cell_of(x[row], inverse, limit)
                keys[p] = (cell << bits) | rank


@device
def sort_worlds(inverse_cell, world_start, work, strips, world_strip):
    """Sort the keys of every world, and find the first place of each strip."""
    keys, scratch = work
    strip_start, strip_world = strips[0], strips[1]
    n_worlds = world_start.shape[0] - 1
    n_strips = 0
    for w in range(n_worlds):
        start, end = world_start[w], world_start[w + 1]
        if inverse_cell[w] != 0.0:
            sort_keys(keys, scratch, start, end)
        bits = rank_bits(end - start)
        shift = bits + ((KEY_BITS - bits) >> 1)
        world_strip[w] = n_strips
        last = -1
        for p in range(start, end):
            strip = keys[p] >> shift
            if strip != last:
                strip_start[n_strips] = p
                strip_world[n_strips] = w
            n_strips += strip != last
            last = strip
        strip_start[n_strips] = end
    world_strip[n_worlds] = n_strips


@device
def put_places(pos, worlds, keys, placed, points, begin, end):
    """Set row and position of the places [begin, end)."""
    x, y, z = pos
    world_start, members = worlds
    order, place = placed[0], placed[1]
    sx, sy, sz = points[0], points[1], points[2]
    for w in range(world_start.shape[0] - 1):
        start, stop = world_start[w], world_start[w + 1]
        mask = (1 << rank_bits(stop - start)) - 1
        for p in range(max(start, begin), min(stop, end)):
            row = members[start + (keys[p] & mask)]
            order[p] = row
            place[row] = p
            sx[p] = x[row]
            sy[p] = y[row]
            sz[p] = z[row]


KEYS, PART, SORT, PLACES = 1, 2, 4, 8


@kernel("(F F F) F (I I) (Iw Iw) I2w F2w (I2w Iw) (i8 i8 i8)")
def build(pos, inverse_cell, worlds, work, placed, points, strips, part):
    """Sort the rows of every world by (cell row, cell, id), and find the first place of each cell row (strip).

    pos: x, y, z (N,) [m]; inverse_cell (n_worlds,) [1/m], 0 for one cell per world; worlds: world_start, members. work: keys (N,)
    hold ranks in their low bits on entry, in any order (fastest in the last sorted order); scratch (N,). Written: placed, order and place,
    (2, N); points, positions by place, (3, N + LANES); strips: first place and world of each strip, (2, N + 1), and the first
    strip of each world, (n_worlds + 1,). part: a sum of KEYS, PART, SORT and PLACES, in this order to be done, and the places
    [begin, end) to do it for; PART sorts these among themselves, which leaves little for SORT, which is for all.
    """
    phases, begin, end = part
    if phases & KEYS:
        make_keys(pos, inverse_cell, worlds, work[0], begin, end)
    if phases & PART:
        for w in range(inverse_cell.shape[0]):
            start, stop = max(worlds[0][w], begin), min(worlds[0][w + 1], end)
            if inverse_cell[w] != 0.0 and stop - start > 1:
                insertion_sort(work[0], start, stop, MOVES_PER_KEY * (stop - start))
    if phases & SORT:
        sort_worlds(inverse_cell, worlds[0], work, strips[0], strips[1])
    if phases & PLACES:
        put_places(pos, worlds, work[0], placed, points, begin, end)


@kernel("i8 i8 F F F I F2w")
def update(first, last, x, y, z, place, points):
    """Update the positions of rows [first, last), which keep their places; x, y, z (N,) [m]."""
    for i in range(first, last):
        p = place[i]
        points[0, p] = x[i]
        points[1, p] = y[i]
        points[2, p] = z[i]


@kernel("F I Fw")
def gather(column, order, out):
    """Set out[p] = column[order[p]]."""
    for p in range(order.shape[0]):
        out[p] = column[order[p]]


@kernel("I F2 F2w (i8 i8)")
def query_positions(queries, points, out, part):
    """Positions [m] of the queries [begin, end), the columns of out (3, n), from those by place."""
    for k in range(part[0], part[1]):
        p = queries[k]
        out[0, k] = points[0, p]
        out[1, k] = points[1, p]
        out[2, k] = points[2, p]


FINE, MAX_FINE = 64.0, float(1 << 29)
"""Queries of a strip are ordered by the 64ths of a cell that they lie in, up to so many from the origin."""


@device
def group_queries(index, inverse_cell, first, last, x, cuts):
    """Split the places of rows [first, last) into blocks of up to LANES places of one strip, from west to east. Returns their number.

    The more compact a block, the fewer candidates it has; results do not depend on which rows share a block.
    """
    order, strips, world_strip, _, _ = index
    strip_start, strip_world = strips[0], strips[1]
    queries, block_first, block_strip, scratch = cuts[0], cuts[1], cuts[2], cuts[3]
    n_blocks = 0
    done = 0
    for strip in range(world_strip[world_strip.shape[0] - 1]):
        begin = done
        inverse = FINE * inverse_cell[strip_world[strip]]
        for p in range(strip_start[strip], strip_start[strip + 1]):
            row = order[p]
            if done < last - first:
                queries[done] = (cell_of(x[p], inverse, MAX_FINE) << 32) | p
            done += (row >= first) & (row < last)
        if inverse != 0.0:
            sort_keys(queries, scratch, begin, done)
        for k in range(begin, done):
            queries[k] &= 0xFFFFFFFF
        while begin < done:
            block_first[n_blocks] = begin
            block_strip[n_blocks] = strip
            n_blocks += 1
            begin = min(begin + LANES, done)
    block_first[n_blocks] = done
    return n_blocks


@device
def lower_bound(keys: Any, start: int, end: int, bound: int) -> int:
    """First place in [start, end) with a key >= bound."""
    while start < end:
        middle = (start + end) >> 1
        if keys[middle] < bound:
            start = middle + 1
        else:
            end = middle
    return start


@device
def step_to(keys: Any, start: int, end: int, bound: int, guess: int) -> int:
    """Like `lower_bound`, by linear search from a guess."""
    while guess > start and keys[guess - 1] >= bound:
        guess -= 1
    while guess < end and keys[guess] < bound:
        guess += 1
    return guess


@device
def rectangle(x, y, start, end):
    """Bounding rectangle of the points [start, end): west, east, south, north."""
    west, east, south, north = x[start], x[start], y[start], y[start]
    for q in range(start + 1, end):
        west = min(west, x[q])
        east = max(east, x[q])
        south = min(south, y[q])
        north = max(north, y[q])
    return west, east, south, north


@device
def find_spans(cells, index, points, arrays, part):
    """Candidate runs of the blocks [b0, b1): all entities of their world within `reach` of a query, and more.

    points: positions of the queries in query order [m], (3, n); part: b0, b1 and the range of spans to fill; for the rest see
    `cut_blocks`. Returns the number of spans, which may exceed that range (then call again with more), and the largest number of
    candidates of one block.
    """
    inverse_cell, reach = cells
    _, strips, world_strip, world_start, keys = index
    cuts, spans = arrays
    strip_start, strip_world = strips[0], strips[1]
    block_first, block_strip, span_first, span_last = cuts[1], cuts[2], cuts[3], cuts[4]
    span_start, span_end = spans[0], spans[1]
    b0, b1, n_spans, room = part
    n_strips = world_strip[world_strip.shape[0] - 1]
    cursor, cursor_end, cursor_of = np.empty((3, n_strips), np.int64)
    cursor_of[:] = -1
    most = 0
    for b in range(b0, b1):
        span_first[b] = n_spans
        own = block_strip[b]
        w = strip_world[own]
        start = world_start[w]
        end = world_start[w + 1]
        inverse = inverse_cell[w]
        total = 0
        if inverse == 0.0:
            if n_spans < room:
                span_start[n_spans] = start
                span_end[n_spans] = end
            n_spans += 1
            span_last[b] = n_spans
            most = max(most, end - start)
            continue
        bits = rank_bits(end - start)
        cell_bits = (KEY_BITS - bits) >> 1
        limit = float((1 << (cell_bits - 1)) - 1)
        west, east, south, north = rectangle(points[0], points[1], block_first[b], block_first[b + 1])
        low_row = cell_of(south - reach[w], inverse, limit)
        high_row = cell_of(north + reach[w], inverse, limit)
        low = cell_of(west - reach[w], inverse, limit)
        high = cell_of(east + reach[w], inverse, limit) + 1
        strip = own
        while strip > world_strip[w] and keys[strip_start[strip - 1]] >> (bits + cell_bits) >= low_row:
            strip -= 1
        before = -1
        while strip < world_strip[w + 1]:
            row = keys[strip_start[strip]] >> (bits + cell_bits)
            if row > high_row:
                break
            if row >= low_row:
                begin = strip_start[strip]
                stop = strip_start[strip + 1]
                from_key = ((row << cell_bits) + low) << bits
                to_key = ((row << cell_bits) + high) << bits
                if cursor_of[strip] == own:
                    i = step_to(keys, begin, stop, from_key, cursor[strip])
                    j = step_to(keys, begin, stop, to_key, cursor_end[strip])
                else:
                    i = lower_bound(keys, begin, stop, from_key)
                    j = lower_bound(keys, i, stop, to_key)
                    cursor_of[strip] = own
                cursor[strip] = i
                cursor_end[strip] = j
                if i < j:
                    total += j - i
                    if i == before:
                        n_spans -= 1
                    elif n_spans < room:
                        span_start[n_spans] = i
                    if n_spans < room:
                        span_end[n_spans] = j
                    before = j
                    n_spans += 1
            strip += 1
        span_last[b] = n_spans
        most = max(most, total)
    return n_spans, most


GROUP, SPANS = 1, 2


@kernel("(I I2 I I I) (i8 i8) F2 (F F) (I2w I2w) F2w (i8 i8 i8 i8 i8) -> i8 i8 i8")
def cut_blocks(index, rows, points, cells, arrays, out, part):
    """Write the queries of rows [first, last) in blocks, their places, and the candidate runs of every block.

    index: order, strips, world_strip, world_start, keys. rows: first, last. points: positions by place [m], (3, n). cells: inverse_cell
    [1/m], reach [m], (n_worlds,). Written: arrays, that is cuts (queries, block_first, block_strip, span_first, span_last; 5, n + 1)
    and spans (span_start, span_end); out (positions by query). part: a sum of GROUP (for all blocks) and SPANS, the blocks [b0, b1) to
    find spans for, b1 -1 for all, and the range of spans for them. Returns the number of blocks, the end of the spans, which may
    exceed that range, and the largest number of candidates of one block.
    """
    cuts = arrays[0]
    phases, b0, b1, s0, s1 = part
    if phases & GROUP:
        b1 = group_queries(index, cells[0], rows[0], rows[1], points[0], cuts)
    used, most = s0, 0
    if phases & SPANS:
        query_positions(cuts[0], points, out, (cuts[1, b0], cuts[1, b1]))
        used, most = find_spans(cells, index, out, arrays, (b0, b1, s0, s1))
    return b1, used, most
