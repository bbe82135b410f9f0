"""A sensor of the own position along x and of the time."""

from __future__ import annotations

import numpy as np

from tussle.api import GroupView, Output, Param, Sensor


class RLSimpleSensor(Sensor):
    """Observes x [m] and the time [s], for `RLSimple`."""

    grade = "portable"

    include_id = Param(False, doc="Put the id of the entity before it.")
    observation = Output(fields="value", ragged=True, doc="Numbers of an observation.")

    def spawn(self, g: GroupView, rows: np.ndarray) -> None:
        """Observe the initial states, which actors see first. Other rows keep their observations."""
        self._observe(g, rows)

    def step(self, g: GroupView) -> None:
        self._observe(g, np.arange(g.n))

    def _observe(self, g: GroupView, rows: np.ndarray) -> None:
        """Set the observations of some rows."""
        parts = [self.observation[row] for row in range(g.n)]
        with_id, t = np.broadcast_to(self.include_id, g.n), np.broadcast_to(g.t, g.n)
        for row in rows:
            ids = [float(g.id[row])] if with_id[row] else []
            parts[row] = np.array([[*ids, g.pos[0, row], t[row]]])
        self.observation.set(
            np.cumsum([0, *(part.shape[1] for part in parts)]), np.concatenate(parts, axis=1)
        )
