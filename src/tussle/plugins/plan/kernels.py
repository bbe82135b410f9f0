"""Kernels of the planner's tree."""

import numpy as np

from tussle.numeric.kernel import device, kernel


@kernel("F2 F2 F i8 f8 Iw")
def select(samples, points, cost, n, radius, selected):
    """Choose a point for each sample, (d, B): the cheapest within `radius`, else the nearest one, of the first n of points, (d, N)."""
    square = np.empty(n)
    for b in range(samples.shape[1]):
        square[:] = 0.0
        for k in range(points.shape[0]):
            at = samples[k, b]
            for i in range(n):
                gap = points[k, i] - at
                square[i] += gap * gap
        nearest, least, cheapest, best = 0, np.inf, -1, np.inf
        for i in range(n):
            if square[i] < least:
                nearest, least = i, square[i]
            if square[i] <= radius * radius and cost[i] < best:
                cheapest, best = i, cost[i]
        selected[b] = cheapest if cheapest >= 0 else nearest


@device
def slot_of(cells, table, b):
    """Slot of cell cells[:, b] in a hash table, whose columns are a number + 1 and the cell; a free one, of number 0, if it is new."""
    h = 0
    for k in range(cells.shape[0]):
        h = (h * 1000003 + cells[k, b]) & 0xFFFFFFFFFF
    s = (h ^ (h >> 15)) % table.shape[1]
    while table[0, s] != 0:
        is_same = True
        for k in range(cells.shape[0]):
            is_same = is_same and table[k + 1, s] == cells[k, b]
        if is_same:
            return s
        s = (s + 1) % table.shape[1]
    return s


@kernel("I2 F B i8 I2w Fw Iw -> i8")
def admit(cells, cost, allowed, n_cells, table, best, number):
    """Number the cells of branches that are the cheapest of their cell so far, taken one after another. Returns the number of cells.

    cells: (d, B). table: see `slot_of`. best: least cost of each cell, by its number. number, written: cell of each branch that is
    kept, else -1, (B,); a later one of the same cell is cheaper.
    """
    for b in range(cost.shape[0]):
        number[b] = -1
        if not allowed[b]:
            continue
        s = slot_of(cells, table, b)
        if table[0, s] == 0:
            table[0, s] = n_cells + 1
            for k in range(cells.shape[0]):
                table[k + 1, s] = cells[k, b]
            best[n_cells] = np.inf
            n_cells += 1
        index = table[0, s] - 1
        if cost[b] < best[index]:
            best[index] = cost[b]
            number[b] = index
    return n_cells
