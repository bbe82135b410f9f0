"""Births from a recorded table instead of the blocks' placement."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from tussle.api.bodies import Bodies
from tussle.api.context import Context
from tussle.engine.births import Births, Occupancy
from tussle.engine.params import Overrides
from tussle.errors import MissionError, listed, nearest_name
from tussle.mission import Block

if TYPE_CHECKING:
    from tussle.record import FirstStates


class RecordedBirths(Births):
    """Takes ids, birth times and initial states from a table. Entities that plugins spawn are created as in `Births`.

    Args:
        overrides: As for `Births`.
        context: As for `Births`.
        start: Time of step 0 [s].
        table: Birth times and initial states.

    Raises:
        MissionError: The table does not fit the mission's blocks.
    """

    def __init__(self, overrides: Overrides, context: Context, start: float, table: FirstStates) -> None:
        super().__init__(overrides, context, start)
        self.table = table
        mission = overrides.mission
        block = blocks_of(table, mission.blocks)
        self.rows = [np.flatnonzero(block == i) for i in range(len(mission.blocks))]
        """Rows of the table for each block, in the order of birth."""
        # Rounded: a recorded time may differ from the time of its step in the last bits.
        self.step = np.maximum(0, np.floor((table.t - start) / mission.dt + 0.5)).astype(np.int64)
        self.dt = mission.dt
        self.has_rates = bool((self.step > 0).any())

    def begin(self, worlds: np.ndarray) -> dict[int, np.ndarray]:
        self.next_id[worlds] = int(self.table.id.max(initial=0)) + 1
        self.n_born[:, worlds] = 0
        for i, rows in enumerate(self.rows):
            self.n_left[i, worlds] = len(rows)
        return self._enter(worlds, np.zeros(len(worlds), np.int64))

    def due(self, t: np.ndarray, running: np.ndarray) -> dict[int, np.ndarray]:
        worlds = np.flatnonzero(running)
        return self._enter(worlds, np.floor((t[worlds] - self.start) / self.dt + 0.5).astype(np.int64))

    def _enter(self, worlds: np.ndarray, step: np.ndarray) -> dict[int, np.ndarray]:
        found = {}
        for i, rows in enumerate(self.rows):
            n_so_far = np.searchsorted(self.step[rows], step, side="right")
            n_new = n_so_far - (len(rows) - self.n_left[i, worlds])
            if n_new.any():
                found[i] = np.repeat(worlds, n_new)
                self.n_left[i, worlds] -= n_new
        return found

    def create(
        self,
        new: Bodies,
        mine: slice,
        block: int,
        worlds: np.ndarray,
        where: dict[str, np.ndarray] | None = None,
        occupancy: Occupancy | None = None,
    ) -> None:
        if where is not None:
            super().create(new, mine, block, worlds, where, occupancy)
            return
        rows, table = self.rows[block], self.table
        # n_left has been reduced by the entities that are due; the last of them is the last entered.
        n_entered = len(rows) - self.n_left[block, worlds]
        _, first, counts = np.unique(worlds, return_index=True, return_counts=True)
        place = np.arange(len(worlds)) - np.repeat(first, counts)
        entering = rows[n_entered - np.repeat(counts, counts) + place]
        states = {name: getattr(table, name)[:, entering] for name in ("pos", "quat", "vel")}
        if table.team is not None:
            states["team"] = table.team[entering]
        next_id = self.next_id.copy()
        super().create(new, mine, block, worlds, states)
        self.next_id[:] = next_id
        new.id[mine] = table.id[entering]


def blocks_of(table: FirstStates, blocks: Sequence[Block]) -> np.ndarray:
    """Block number of each entity, (m,): by name, otherwise the first block of its team that is not full, in order of ids.

    Raises:
        MissionError: An entity fits no block, or its team does not exist in the mission.
    """
    names, teams = [b.name for b in blocks], {b.team for b in blocks}
    block = np.full(len(table), -1)
    n_free = np.array([b.count for b in blocks])
    for row in np.argsort(table.id, kind="stable"):
        entity = f"{table.source}: entity {table.id[row]}"
        team = None if table.team is None else int(table.team[row])
        if team is not None and team not in teams:
            raise MissionError(
                f"{entity} is of team {team}, but no block has this team; {listed(map(str, sorted(teams)))}"
            )
        if table.block is not None:
            name = table.block[row]
            if name not in names:
                raise MissionError(
                    f"{entity} is of block {name!r}, which does not exist{nearest_name(name, names)}; {listed(names)}"
                )
            block[row] = names.index(name)
            continue
        fitting = [i for i, b in enumerate(blocks) if n_free[i] > 0 and team in (None, b.team)]
        if not fitting:
            of_team = "" if team is None else f" of team {team}"
            count = sum(b.count for b in blocks if team in (None, b.team))
            raise MissionError(f"{entity} exceeds the {count} entities{of_team} of the mission's blocks")
        block[row] = fitting[0]
        n_free[fitting[0]] -= 1
    return block
