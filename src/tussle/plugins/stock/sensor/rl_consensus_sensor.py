"""A sensor of the positions of all entities along x."""

from __future__ import annotations

import numpy as np

from tussle.api import GroupView, Output, Param, Sensor


class RLConsensusSensor(Sensor):
    """Observes x [m] of all entities of the world, itself included, in the order of their ids, for `RLConsensus`."""

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
        bodies, parts = g.bodies, [self.observation[row] for row in range(g.n)]
        with_id = np.broadcast_to(self.include_id, g.n)
        for world in np.unique(g.world[rows]):
            members = np.flatnonzero(bodies.world == world)
            x = bodies.pos[0, members[np.argsort(bodies.id[members])]]
            for row in rows[g.world[rows] == world]:
                parts[row] = np.concatenate([[float(g.id[row])], x] if with_id[row] else [x])[None]
        self.observation.set(
            np.cumsum([0, *(part.shape[1] for part in parts)]),
            np.concatenate([np.zeros((1, 0)), *parts], axis=1),
        )
