"""Neighbour queries for NumPy code: pairs in range with reductions per row, and k nearest neighbours."""

from __future__ import annotations

from typing import Any

import numpy as np

from tussle.api.bodies import Bodies, BodyView
from tussle.declare.lists import Segments
from tussle.errors import ParameterError
from tussle.numeric.neighbors import queries, search
from tussle.numeric.neighbors.index import Index


class Pairs(Segments):
    """Pairs of a row and another entity of its world, ordered by row; the order within a row is deterministic.

    Body columns of the other entity are attributes too: `near.vel` (3, m), `near.team` (m,), `near.yaw` (m,), ...
    `near[mask]`, with a boolean mask (m,), selects pairs.

    Attributes:
        row: Row in the group, (m,).
        other: Row of the other entity in the body table, (m,).
        offset: Position of the other entity minus position of the row [m], (3, m), world frame.
        distance: Length of `offset` [m], (m,).
        count: Number of pairs of each row, (n,).
        start: Index of the first pair of each row, then the number of pairs, (n + 1,), as `start` of a `RaggedColumn`.
    """

    items = "pairs"

    def __init__(self, found: queries.PairArrays, bodies: BodyView) -> None:
        self.row, self.other = found.row, found.other
        self.offset, self.distance = found.offset, found.distance
        self.count, self.start = found.count, found.start
        self._bodies = bodies

    def __len__(self) -> int:
        return len(self.row)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._bodies, name)[..., self.other]

    def __getitem__(self, mask: Any) -> Pairs:
        mask = np.asarray(mask)
        if mask.dtype != bool or mask.shape != self.row.shape:
            raise ParameterError(
                f"near[...] takes a boolean mask of shape ({len(self)},), one per pair, not {mask.dtype} {mask.shape}"
            )
        start = np.concatenate([[0], np.cumsum(mask)])[self.start]
        kept = (
            self.row[mask],
            self.other[mask],
            self.offset[:, mask],
            self.distance[mask],
            np.diff(start),
            start,
        )
        return Pairs(queries.PairArrays(*kept), self._bodies)

    def nearest(self) -> np.ndarray:
        """Index of the pair with the smallest distance in each row, (n,); -1 for rows without pairs."""
        return self.argmin(self.distance)


class Nearest:
    """The k nearest other entities of each row.

    Attributes:
        other: Row in the body table, (k, n), nearest first; -1 where there are fewer than k.
        distance: Distance [m], (k, n); infinity where `other` is -1.
        offset: Position of the other entity minus position of the row [m], (3, k, n), world frame; 0 where `other` is -1.
    """

    def __init__(self, other: np.ndarray, distance: np.ndarray, offset: np.ndarray) -> None:
        self.other, self.distance, self.offset = other, distance, offset


def find_pairs(
    index: Index,
    range_points: np.ndarray,
    rows: tuple[int, int],
    pos: np.ndarray,
    radius: Any,
    teams: Any,
    bodies: BodyView,
) -> Pairs:
    """See `GroupView.near`. Rows [first, last) of the body table are at `pos` [m], (3, n)."""
    x, y, z = pos
    reach = np.ascontiguousarray(radius, float) if isinstance(radius, np.ndarray) else np.full(len(x), radius)
    found = queries.pairs(index, *rows, x, y, z, reach, bodies.team, _checked(teams), range_points)
    return Pairs(found, bodies)


def find_nearest(
    bodies: Bodies,
    rows: tuple[int, int],
    pos: np.ndarray,
    k: int,
    teams: Any,
    among: np.ndarray | None = None,
) -> Nearest:
    """See `GroupView.nearest`. Rows [first, last) of the body table are at `pos` [m], (3, n)."""
    index, (x, y, z) = bodies.any_index(), pos
    if among is not None:
        if teams is not None:
            raise ParameterError("g.nearest takes teams or among, not both")
        mask = np.asarray(among)
        if mask.dtype != bool or mask.shape != (bodies.n,):
            raise ParameterError(
                f"g.nearest: among is a boolean mask of shape ({bodies.n},), not {mask.dtype} {mask.shape}"
            )
        other, distance = queries.nearest(index, *rows, x, y, z, k, mask.astype(np.int64), 1)
    elif isinstance(teams, np.ndarray):
        other, square = np.empty((k, len(x)), np.int64), np.empty((k, len(x)))
        order = index.row_world, index.place, index.order
        table = (*index.table, bodies.by_place(index, "team")[0])
        search.nearest_rows(
            (x, y, z, teams.astype(float)), k, search.SAME, order, rows[0], table, other, square
        )
        distance = np.sqrt(square)
    else:
        other, distance = queries.nearest(index, *rows, x, y, z, k, bodies.team, _checked(teams))
    there = other >= 0
    offset = np.where(there, bodies.pos[:, np.where(there, other, 0)] - pos[:, None, :], 0.0)
    return Nearest(other, distance, offset)


def _checked(teams: Any) -> Any:
    if (
        teams is None
        or (isinstance(teams, (int, np.integer)) and not isinstance(teams, bool))
        or teams in ("own", "other")
    ):
        return int(teams) if isinstance(teams, np.integer) else teams
    raise ParameterError(f"teams = {teams!r} is not allowed; it is 'own', 'other', a team number or None")
