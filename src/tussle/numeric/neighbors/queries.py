"""Range and nearest-neighbour queries for NumPy code."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tussle.numeric.neighbors import search
from tussle.numeric.neighbors.index import Floats, Index, Longs

Teams = str | int | None


@dataclass(frozen=True, slots=True)
class PairArrays:
    """All pairs of a row and an entity in range, ordered by row, then as in the index. Row i has pairs start[i] to start[i + 1] - 1."""

    row: Longs
    """Row in the group, (m,)."""
    other: Longs
    """Row of the neighbour in the table, (m,)."""
    offset: Floats
    """Vector from the row to the neighbour [m], (3, m), world frame."""
    distance: Floats
    """Length of the offset [m], (m,)."""
    count: Longs
    """Number of pairs of each row, (n,)."""
    start: Longs
    """First pair of each row, then the total number of pairs, (n + 1,)."""


def team_filter(
    index: Index, team: NDArray[np.int64] | None, teams: Teams, first: int, last: int
) -> tuple[int, Floats, Floats]:
    """Filter `teams` (None, "own", "other" or a team number) as a mode, team by place and wanted team by row."""
    n = last - first
    if teams is None:
        return search.ANY, index.points[0], np.zeros(n)
    if team is None:
        raise ValueError(f"teams={teams!r} needs the argument team, the teams of the table")
    by_row = team.astype(np.float64)
    if isinstance(teams, str):
        modes = {"own": search.SAME, "other": search.DIFFERENT}
        if teams not in modes:
            raise ValueError(f'teams={teams!r} must be None, "own", "other" or a team number')
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
    range_points: Floats | None = None,
) -> PairArrays:
    """Find all entities nearer than a radius to rows of the table. A row is never its own neighbour.

    Args:
        index: Spatial index of the table. Results are correct for any radius; the reach of the index only affects speed.
        first: First row of the table to query.
        last: One after the last row.
        x: Assumed east positions of these rows [m], (n,); they may differ from those in the table.
        y: North positions [m], (n,).
        z: Up positions [m], (n,).
        radius: Radius of each row [m], (n,).
        team: Teams of the table, (N,); required unless `teams` is None.
        teams: None for all, "own", "other", or a team number.
        range_points: Positions by place that decide who is in range [m], (3, N + LANES), where they are not those of the table;
            for an index whose reaches are infinite.

    Raises:
        ValueError: `teams` has another value, or `team` is missing.
    """
    n = last - first
    mode, by_place, wanted = team_filter(index, team, teams, first, last)
    points = index.points if range_points is None else range_points
    start, count = np.zeros(n + 1, np.int64), np.zeros(n, np.int64)
    query = (
        (x, y, z, radius, wanted), mode, (index.row_world, index.place), first, (*index.table[:-1], points, by_place), start
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
    return PairArrays(row, other, offset, distance, count, start)


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
    """Find the k nearest entities to each of the rows [first, last), by (distance, id), at any distance, without the row itself.

    Arguments are those of `pairs`. Returns rows of the table (k, n) and distances [m] (k, n), -1 and inf if there are fewer.

    Raises:
        ValueError: `teams` has another value, or `team` is missing.
    """
    n = last - first
    mode, by_place, wanted = team_filter(index, team, teams, first, last)
    other, square = np.empty((k, n), np.int64), np.empty((k, n))
    search.nearest_rows(
        (x, y, z, wanted), k, mode, (index.row_world, index.place, index.order), first, (*index.table, by_place), other, square
    )  # fmt: skip
    return other, np.sqrt(square)
