"""Pairs in range and nearest neighbours for NumPy code, and sums over the pairs of each row."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tussle.neighbors import search
from tussle.neighbors.index import Floats, Index, Longs

Teams = str | int | None


@dataclass(frozen=True, slots=True)
class Pairs:
    """Everyone near each row, by row, then in the index's order. Pairs of row i are start[i] ... start[i + 1] - 1."""

    row: Longs
    """Row of the group, (m,)."""
    other: Longs
    """Row of the table, (m,)."""
    offset: Floats
    """From the row to the other [m], (3, m), world frame."""
    distance: Floats
    """Length of the offset [m], (m,)."""
    count: Longs
    """Pairs of each row, (n,)."""
    start: Longs
    """First pair of each row, and behind it the number of all, (n + 1,)."""


def team_filter(
    index: Index, team: NDArray[np.int64] | None, teams: Teams, first: int, last: int
) -> tuple[int, Floats, Floats]:
    """Mode, team by place and team to compare with by row, of the filter `teams`: None, "own", "other" or a number."""
    n = last - first
    if teams is None:
        return search.ANY, index.points[0], np.zeros(n)
    if team is None:
        raise ValueError(f"a filter teams={teams!r} needs the table's teams")
    by_row = team.astype(np.float64)
    if isinstance(teams, str):
        modes = {"own": search.SAME, "other": search.DIFFERENT}
        if teams not in modes:
            raise ValueError(f'teams={teams!r} is not None, "own", "other" or a team number')
        return modes[teams], index.gather(by_row), np.ascontiguousarray(by_row[first:last])
    return search.SAME, index.gather(by_row), np.full(n, float(teams))


def pairs(
    index: Index,
    first: int,
    last: int,
    x: Floats,
    y: Floats,
    z: Floats,
    radius: Floats,
    team: Longs | None = None,
    teams: Teams = None,
) -> Pairs:
    """Everyone nearer than `radius` (n,) [m] to the rows [first, last) of the table, taken to be at x, y, z (n,) [m].

    `team` (N,) is the table's column, needed for a filter. A row is never near itself. Any radius is correct; the index's reach
    only decides what is fast.
    """
    n = last - first
    mode, by_place, wanted = team_filter(index, team, teams, first, last)
    start, count = np.zeros(n + 1, np.int64), np.zeros(n, np.int64)
    query = (
        (x, y, z, radius, wanted), mode, (index.row_world, index.place), first, (*index.table, by_place), start
    )  # fmt: skip
    m = search.pair_places(*query, (count, np.zeros(0, np.int64)))
    np.cumsum(count, out=start[1:])
    found, row, other = np.empty(m, np.int64), np.empty(m, np.int64), np.empty(m, np.int64)
    offset, distance = np.empty((3, m)), np.empty(m)
    if m:
        search.pair_places(*query, (count, found))
        search.pair_columns(
            (x, y, z), start, found, index.points, index.order, (row, other), offset, distance
        )
    return Pairs(row, other, offset, distance, count, start)


def nearest(
    index: Index,
    first: int,
    last: int,
    x: Floats,
    y: Floats,
    z: Floats,
    k: int = 1,
    team: Longs | None = None,
    teams: Teams = None,
) -> tuple[Longs, Floats]:
    """The k nearest rows of the table to each of the rows [first, last), by (distance, id), at any distance; not oneself.

    Returns rows (k, n), -1 where there are fewer, and distances (k, n) [m], inf there.
    """
    n = last - first
    mode, by_place, wanted = team_filter(index, team, teams, first, last)
    other, square = np.empty((k, n), np.int64), np.empty((k, n))
    search.nearest_rows(
        (x, y, z, wanted), k, mode, (index.row_world, index.place, index.order), first, (*index.table, by_place), other, square
    )  # fmt: skip
    return other, np.sqrt(square)
