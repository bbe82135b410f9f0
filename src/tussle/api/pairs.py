"""Who is near whom, for NumPy code: pairs in range with reductions per row, and nearest others."""

from __future__ import annotations

from typing import Any

import numpy as np

from tussle.api.bodies import Bodies, BodyView
from tussle.errors import ParameterError
from tussle.lists import Segments
from tussle.neighbors import queries, search
from tussle.neighbors.index import Index


class Pairs(Segments):
    """Pairs of a row and another entity of its world, ordered by row, each row's in a fixed order.

    Any body column of the other is an attribute too: `near.vel` (3, m), `near.team` (m,), `near.yaw` ...
    `near[mask]`, (m,) true or false, is the pairs that it keeps.

    Attributes:
        row: Row of the group, (m,).
        other: Row of the other in the body table, (m,).
        offset: From the row to the other [m], (3, m), world frame.
        distance: Its length [m], (m,).
        count: Number of pairs of each row, (n,).
        start: First pair of each row, and the end, (n + 1,): where the lists of a `RaggedColumn` begin.
    """

    items = "pairs"

    def __init__(self, found: queries.Pairs, bodies: BodyView) -> None:
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
                f"near[...] takes a mask: true or false for each of the {len(self)} pairs, not {mask.dtype} {mask.shape}"
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
        return Pairs(queries.Pairs(*kept), self._bodies)

    def nearest(self) -> np.ndarray:
        """Pair with the smallest distance of each row, (n,); -1 for rows without pairs."""
        return self.argmin(self.distance)


class Nearest:
    """The k nearest others of each row.

    Attributes:
        other: Row in the body table, (k, n); -1 where there are fewer than k.
        distance: [m], (k, n); infinity there.
        offset: From the row to the other [m], (3, k, n); 0 there.
    """

    def __init__(self, other: np.ndarray, distance: np.ndarray, offset: np.ndarray) -> None:
        self.other, self.distance, self.offset = other, distance, offset


def find_pairs(
    index: Index, rows: tuple[int, int], pos: np.ndarray, radius: Any, teams: Any, bodies: BodyView
) -> Pairs:
    """See `GroupView.near`; rows [first, last) of the table are at pos [m], (3, n)."""
    x, y, z = pos
    reach = np.ascontiguousarray(radius, float) if isinstance(radius, np.ndarray) else np.full(len(x), radius)
    return Pairs(queries.pairs(index, *rows, x, y, z, reach, bodies.team, _checked(teams)), bodies)


def find_nearest(bodies: Bodies, rows: tuple[int, int], pos: np.ndarray, k: int, teams: Any) -> Nearest:
    """See `GroupView.nearest`; rows [first, last) of the table are at pos [m], (3, n)."""
    index, (x, y, z) = bodies.any_index(), pos
    if isinstance(teams, np.ndarray):
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
