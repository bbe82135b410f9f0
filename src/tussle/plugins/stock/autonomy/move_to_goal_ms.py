"""A behaviour that goes to a point."""

from __future__ import annotations

import numpy as np

from tussle.api import Behavior, GroupView, HistoricAttributes, Param, State, Subscribe, unit
from tussle.declare.messages import Waypoint

AHEAD = 1e6  # [m]


def length(v: np.ndarray) -> np.ndarray:
    """Lengths, (n,), of vectors, (3, n)."""
    return np.asarray(np.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]))


class MoveToGoalMS(Behavior):
    """Moves towards the goal; a PID on the distance gives the speed. A `Waypoint` message replaces the goal."""

    grade = "portable"
    historic_attributes = HistoricAttributes(
        joined={"distance_pid": ("p_gain", "i_gain", "d_gain", "integral_band")}
    )

    goal = Param((0.0, 0.0, 0.0), fields="x y z", unit="m", doc="Point to go to.")
    use_initial_heading = Param(False, doc="Place the goal 1000 km ahead of the initial position.")
    distance_pid = Param((0.5, 0.0, 0.0, 0.0), fields="kp ki kd band", doc="Gains from distance to speed.")
    target = State("x y z", unit="m", doc="Current goal.")
    integral = State(unit="m s", doc="Integral of the distance.")
    previous = State(unit="m", doc="Distance at the last call.")
    waypoints = Subscribe(Waypoint, network_param="network_name")
    network_name = Param("LocalNetwork", doc="Network that carries the waypoints.")

    def spawn(self, g: GroupView, rows: np.ndarray) -> None:
        pos = g.pos[:, rows]
        ahead = pos + AHEAD * g.column("forward", rows)
        target = np.where(self.use_initial_heading[rows], ahead, self.goal[:, rows])
        self.target[:, rows] = target
        # The derivative term is zero at the first call.
        self.previous[rows] = length(target - pos)

    def step(self, g: GroupView) -> None:
        if self.waypoints:
            rows, messages = self.waypoints.latest()
            self.target[:, rows] = messages.pos
        offset = self.target - g.pos
        distance = length(offset)
        kp, ki, kd, band = self.distance_pid
        self.integral[:] = np.where(distance > band, 0.0, self.integral + distance * g.dt)
        speed = kp * distance + ki * self.integral + kd * (distance - self.previous) / g.dt
        self.previous[:] = distance
        self.desired_velocity[:] = unit(offset) * speed
