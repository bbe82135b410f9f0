"""A sensor of the positions of all along x."""

from __future__ import annotations

import numpy as np

from tussle.api import GroupView, Output, Param, Sensor


class RLConsensusSensor(Sensor):
    """Observes x [m] of all entities of the world, itself included, in the order of their ids, for `RLConsensus`."""

    grade = "portable"

    include_id = Param(False, doc="Put the id of the entity before it.")
    observation = Output(fields="value", ragged=True, doc="Numbers of an observation.")

    def spawn(self, g: GroupView, rows: np.ndarray) -> None:
        """Observe the initial states, which actors see first."""
        self.step(g)

    def step(self, g: GroupView) -> None:
        bodies, parts = g.bodies, []
        with_id = np.broadcast_to(self.include_id, g.n).astype(bool)
        worlds: dict[int, np.ndarray] = {}
        for world in np.unique(g.world):
            rows = np.flatnonzero(bodies.world == world)
            worlds[world] = bodies.pos[0, rows[np.argsort(bodies.id[rows])]]
        for row in range(g.n):
            x = worlds[g.world[row]]
            parts.append(np.concatenate([[float(g.id[row])], x]) if with_id[row] else x)
        start = np.concatenate([[0], np.cumsum([len(part) for part in parts])]).astype(np.int64)
        self.observation.set(start, np.concatenate(parts)[None] if parts else np.empty((1, 0)))
