"""Control3D as in SCRIMMAGE."""

from __future__ import annotations

import numpy as np

from tussle.api import GroupView, State
from tussle.plugins.stock.autonomy import control_3d

FIRST_SPEED = 21.0
"""Speed from the start on [m/s]."""


class Control3D(control_3d.Control3D):
    """Control3D that flies on at 21 m/s with its first heading and altitude until the first click or key; in tussle it waits there."""

    is_steered = State(dtype=bool, doc="Whether a click or the key has come.")

    def spawn(self, g: GroupView, rows: np.ndarray) -> None:
        """Start with heading, altitude and 21 m/s."""
        super().spawn(g, rows)
        self.desired_altitude[rows] = g.pos[2, rows]
        self.desired_speed[rows] = FIRST_SPEED
        self.velocity[:, rows] = FIRST_SPEED * g.column("forward", rows)

    def step(self, g: GroupView) -> None:
        """Fly on, or to the point of the last click."""
        for inbox in (self.clicks, self.keys):
            if inbox:
                self.is_steered[inbox.pairs()[0]] = True
        kept = [np.where(self.is_steered, 0.0, column) for column in self._commands()]
        super().step(g)
        for column, first in zip(self._commands(), kept, strict=True):
            column[:] = np.where(self.is_steered, column, first)

    def _commands(self) -> tuple[np.ndarray, ...]:
        return self.desired_heading, self.desired_altitude, self.desired_speed, *self.velocity
