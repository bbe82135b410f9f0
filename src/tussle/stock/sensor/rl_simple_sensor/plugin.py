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
        """Observe the initial states, which actors see first."""
        self.step(g)

    def step(self, g: GroupView) -> None:
        with_id = np.broadcast_to(self.include_id, g.n).astype(bool)
        all_values = np.stack([g.id.astype(float), g.pos[0], np.broadcast_to(g.t, g.n)], axis=1)
        kept = np.stack([with_id, np.ones(g.n, bool), np.ones(g.n, bool)], axis=1)
        self.observation.set(np.concatenate([[0], np.cumsum(kept.sum(axis=1))]), all_values[kept][None])
