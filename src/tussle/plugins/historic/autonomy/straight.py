"""Autonomies that hold or turn a heading, as in SCRIMMAGE."""

from __future__ import annotations

import numpy as np

from tussle.api import Autonomy, Children, GroupView, HistoricAttributes, State
from tussle.plugins.historic.angles import headings
from tussle.plugins.stock.autonomy import autonomy_executor, avoid_walls, control_3d, straight


class Straight(straight.Straight):
    """Straight whose desired heading is not negative: a controller's error then rounds as there."""

    def step(self, g: GroupView) -> None:
        super().step(g)
        self.desired_heading[:] = headings(self.desired_heading)


class AutonomyExecutor(autonomy_executor.AutonomyExecutor):
    """AutonomyExecutor that runs Straight where no autonomies are given; in tussle it does nothing."""

    historic_attributes = HistoricAttributes()
    autonomies = Children(
        Autonomy, by_state=True, shares_channels=True, default=(Straight(),), doc="The autonomies."
    )


class AvoidWalls(avoid_walls.AvoidWalls):
    """AvoidWalls that drives on with `initial_speed` whatever its sensor sees: it listens to a topic to which no sensor talks."""

    def step(self, g: GroupView) -> None:
        """Keep the heading."""
        self.desired_heading[:] = g.yaw


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
