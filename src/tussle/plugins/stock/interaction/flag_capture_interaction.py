"""Rules of capturing a flag."""

from __future__ import annotations

import numpy as np

from tussle.api import Interaction, Param, State, WorldView
from tussle.declare.messages import FlagCaptured, FlagTaken
from tussle.world.scene import Volume


class FlagCaptureInteraction(Interaction):
    """A flag in one region, and the region to which opponents must bring it.

    An entity of another team takes the flag by entering its boundary, also on its straight way between two steps. If several enter in one
    step, the nearest to the centre takes it (on ties the smaller id). The carrier captures the flag, once per game, by entering the
    capture boundary. When the carrier is
    removed, the flag returns to its place and is free again. Publishes `FlagTaken` and `FlagCaptured`. In SCRIMMAGE, if several entities
    enter in one step, each publishes `FlagTaken`, and the last one has the flag.

    Raises:
        MissionError: An id is not that of exactly one boundary of the mission.
    """

    grade = "portable"
    reads_start_positions = True

    flag_boundary_id = Param(2, structural=True, doc="Boundary of the flag; its team owns the flag.")
    capture_boundary_id = Param(1, structural=True, doc="Boundary to which the flag must be brought.")
    carrier = State(dtype=int, per="world", doc="Id of the entity that has the flag; 0 if it is free.")
    is_captured = State(dtype=bool, per="world", doc="Whether the flag has been captured.")

    def named_regions(self) -> tuple[int, ...]:
        """Return both boundaries."""
        return self.values["flag_boundary_id"], self.values["capture_boundary_id"]

    def step(self, w: WorldView) -> None:
        flag, home = w.region(self.flag_boundary_id), w.region(self.capture_boundary_id)
        self.carrier[w.rows_at(np.arange(w.n_worlds), self.carrier) < 0] = 0
        is_free = (self.carrier == 0) & ~self.is_captured
        rows = np.flatnonzero(self._enters(w, flag.shape, is_free[w.world] & (w.team != flag.team)))
        if len(rows):
            carriers, takers = self._takers(w, rows)
            self.carrier[w.world[carriers]] = w.id[carriers]
            self._publish(w, FlagTaken, takers)
        carries = (self.carrier[w.world] == w.id) & ~self.is_captured[w.world]
        rows = np.flatnonzero(self._enters(w, home.shape, carries))
        self.is_captured[w.world[rows]] = True
        self._publish(w, FlagCaptured, rows)

    def _enters(self, w: WorldView, shape: Volume, may: np.ndarray) -> np.ndarray:
        """Return which of the entities that `may`, (n,), were in a region during the step, (n,)."""
        return shape.crossed(w.start_pos, w.pos, may)

    def _takers(self, w: WorldView, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return, of the entering rows, (m,), those that get the flag, and those for which `FlagTaken` is published."""
        x, y, z = w.pos[:, rows] - np.array(w.region(self.flag_boundary_id).center)[:, None]
        rows = rows[np.lexsort((w.id[rows], x * x + y * y + z * z))]
        _, first = np.unique(w.world[rows], return_index=True)
        return rows[first], rows[first]

    def _publish(self, w: WorldView, event: type[FlagTaken | FlagCaptured], rows: np.ndarray) -> None:
        w.publish(event, w.world[rows], entity=w.id[rows], team=w.team[rows], boundary=self.flag_boundary_id)
