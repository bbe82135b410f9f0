"""Random losses of a team."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from tussle.api import Interaction, Param, State, WorldView


class RandomAttrit(Interaction):
    """Removes entities of a team at random, so that their number decreases linearly to zero within `duration`.

    With n entities at `start_after`, ceil(n (1 - t / duration)) are left after another t seconds; all of the team are equally likely
    to be removed, except those of `leave_alive`. SCRIMMAGE removed at most one per step, and its draws had no seed.
    """

    grade = "portable"
    named_teams = ("team",)
    most_per_step: ClassVar[int] = 2**62

    decay_method = Param("linear", choices=("linear",), doc="How the number decreases.")
    start_after = Param(5.0, unit="s", doc="Time at which the losses begin.")
    duration = Param(30.0, unit="s", gt=0.0, doc="Time from the beginning of the losses to the last one.")
    team = Param(1, doc="Team that has losses.")
    leave_alive = Param((1, 2), ragged=True, doc="Ids of entities that are not removed.")
    n_start = State(
        dtype=int,
        default=-1,
        per="world",
        doc="Size of the team at start_after, or when it appears; -1 before.",
    )

    def _elapsed(self, w: WorldView) -> np.ndarray:
        """Time since the losses began [s], (n_worlds,)."""
        return np.asarray(w.t + 1e-6 * w.dt - self.start_after)

    def step(self, w: WorldView) -> None:
        is_team = w.team == self.team[w.world]
        count = np.bincount(w.world[is_team], minlength=w.n_worlds)
        elapsed = self._elapsed(w)
        begins = (self.n_start < 0) & (elapsed >= 0.0) & (count > 0)
        self.n_start[begins] = count[begins]
        left = np.ceil(self.n_start * np.maximum(0.0, 1.0 - elapsed / self.duration))
        n_lost = np.where(self.n_start < 0, 0, np.minimum(count - left.astype(np.int64), self.most_per_step))
        rows = np.flatnonzero(is_team & (n_lost > 0)[w.world] & ~np.isin(w.id, self.values["leave_alive"]))
        lot = w.uniform_by("lot", w.world[rows], w.id[rows], np.zeros(len(rows), np.int64))
        rows = rows[np.lexsort((lot, w.world[rows]))]
        world = w.world[rows]
        rank = np.arange(len(rows)) - np.searchsorted(world, world)
        w.kill(rows[rank < n_lost[world]], "attrition")
