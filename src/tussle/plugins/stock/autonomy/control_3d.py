"""An autonomy that is controlled from the viewer."""

from __future__ import annotations

import numpy as np

from tussle.api import Autonomy, GroupView, Output, Param, State, Subscribe
from tussle.declare.messages import CustomKeyPress, WorldPointClicked
from tussle.numeric import atan2


class Control3D(Autonomy):
    """Goes to the point that was clicked last in the viewer, and stops there. The plugin key `;` stops it or makes it continue.

    It keeps its initial altitude. It slows down in proportion to the distance, with a time constant of 1 s. Before the first click it
    stays at its initial position.
    """

    grade = "portable"

    max_speed = Param(20.0, unit="m/s", ge=0.0, doc="Largest speed.")
    goal = State("x y z", unit="m", doc="Current goal.")
    is_stopped = State(dtype=bool, doc="Whether the key stopped it.")
    clicks = Subscribe(WorldPointClicked, from_outside=True)
    keys = Subscribe(CustomKeyPress, from_outside=True)
    desired_heading = Output(unit="rad")
    desired_altitude = Output(unit="m")
    desired_speed = Output(unit="m/s")
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    def spawn(self, g: GroupView, rows: np.ndarray) -> None:
        self.goal[:, rows] = g.pos[:, rows]
        self.desired_heading[rows] = g.column("yaw", rows)

    def step(self, g: GroupView) -> None:
        if self.clicks:
            rows, messages = self.clicks.latest()
            self.goal[:2, rows] = messages.pos[:2]
            self.is_stopped[rows] = False
        if self.keys:
            rows, _ = self.keys.pairs()
            self.is_stopped[:] ^= np.bincount(rows, minlength=g.n) % 2 == 1
        way = self.goal - g.pos
        with np.errstate(over="ignore"):  # entities extremely far from their goals
            level = np.sqrt(way[0] * way[0] + way[1] * way[1])
            distance = np.sqrt(level * level + way[2] * way[2])
        speed = np.where(self.is_stopped, 0.0, np.minimum(distance, self.max_speed))
        self.velocity[:] = way * (speed / np.where(distance > 0.0, distance, 1.0))
        self.desired_speed[:] = speed
        self.desired_altitude[:] = self.goal[2]
        moves = (speed > 0.0) & (level > 0.0)
        self.desired_heading[moves] = atan2(way[1, moves], way[0, moves])
