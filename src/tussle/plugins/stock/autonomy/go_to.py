"""A waypoint follower for every vehicle."""

from __future__ import annotations

import math
import warnings

import numpy as np

from tussle.api import Autonomy, GroupView, Output, Param, State, Subscribe, unit
from tussle.declare.messages import Waypoint
from tussle.numeric import atan2
from tussle.numeric.ways import closest_approach, turn


def length(v: np.ndarray) -> np.ndarray:
    """Lengths, (n,), of vectors, (k, n)."""
    square = v[0] * v[0]
    for component in v[1:]:
        square = square + component * component
    return np.asarray(np.sqrt(square))


class GoTo(Autonomy):
    """Goes to waypoints in order; without any, it stays where it starts. A `Waypoint` message replaces them by one goal.

    It works with every vehicle: it writes a heading, an altitude and a speed; a velocity; and a position. Only
    channels that the entity's controller or motion model reads are computed. A waypoint is reached when the straight way since the last
    step comes within `tolerance` of it; several may be passed in one step. One that the entity has circled `max_turns` times without
    reaching it, since it lies inside the turning circle, is skipped with a warning, unless it is the last.

    It approaches the last goal with a speed in proportion to the distance below `slowing_distance` (Reynolds 1999, "Steering behaviors
    for autonomous characters", arrival). Within the tolerance of it the desired speed is 0 and the desired heading constant; velocity
    and position lead to the goal itself.
    """

    grade = "portable"

    waypoints = Param((), fields="x y z", unit="m", ragged=True, doc="Points to visit in order, world frame.")
    mode = Param(
        "stop", choices=("stop", "loop", "reverse"), doc="After the last one: stay, start again, or go back."
    )
    speed = Param(10.0, unit="m/s", ge=0.0, doc="Speed between waypoints.")
    tolerance = Param(5.0, unit="m", gt=0.0, doc="Distance at which a waypoint is reached.")
    tolerance_in_2d = Param(False, doc="Measure distances in the horizontal plane, as for ground vehicles.")
    max_turns = Param(
        1.0, ge=0.0, doc="Turns round a waypoint, seen from above, after which it is skipped; 0: it never is."
    )
    slowing_distance = Param(
        20.0, unit="m", ge=0.0, doc="Distance from the last goal at which it slows down."
    )
    network_name = Param("LocalNetwork", doc="Network of the `Waypoint` messages.")
    current = State(dtype=int, doc="Index of the waypoint.")
    is_returning = State(dtype=bool, doc="Whether the waypoints are visited backwards.")
    is_told = State(dtype=bool, doc="Whether a message gave the goal.")
    goal = State("x y z", unit="m", doc="Current goal.")
    heading = State(unit="rad", doc="Desired heading.")
    last = State("x y z", unit="m", doc="Position in the last step.")
    turned = State(unit="rad", doc="Angle by which the entity has gone round the current waypoint.")
    goals = Subscribe(Waypoint, network_param="network_name")
    desired_heading = Output(unit="rad")
    desired_altitude = Output(unit="m")
    desired_speed = Output(unit="m/s")
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")
    position = Output("position_x position_y position_z", unit="m")

    def spawn(self, g: GroupView, rows: np.ndarray) -> None:
        self.goal[:, rows] = self.last[:, rows] = g.pos[:, rows]
        self.heading[rows] = g.yaw[rows]
        listed = rows[self.waypoints.count[rows] > 0]
        self.goal[:, listed] = self.waypoints.data[:, self.waypoints.start[listed]]

    def step(self, g: GroupView) -> None:
        if self.goals:
            rows, messages = self.goals.latest()
            self.goal[:, rows], self.is_told[rows] = messages.pos, True
        flat = np.where(self.tolerance_in_2d, 0.0, 1.0)
        self._pass(g, flat)
        self._skip(g)
        self.last[:] = g.pos
        offset = self.goal - g.pos
        self._command(g, offset, length(np.stack([offset[0], offset[1], flat * offset[2]])))

    def _pass(self, g: GroupView, flat: np.ndarray) -> None:
        """Advance rows for the waypoints that their straight ways pass one after another. `flat` weights heights, (n,)."""
        rows, part, is_first = np.flatnonzero(~self._is_last()), 0.0, True
        while len(rows):
            offset, way = self.last[:, rows] - self.goal[:, rows], g.pos[:, rows] - self.last[:, rows]
            offset[2], way[2] = flat[rows] * offset[2], flat[rows] * way[2]
            now, distance = closest_approach(offset, way, part)
            # After the first: those that are passed later.
            is_there = (distance <= self.tolerance[rows]) & (is_first | (now > part))
            rows, part, is_first = rows[is_there], now[is_there], False
            self._advance(rows)
            goes_on = ~self._is_last()[rows]
            rows, part = rows[goes_on], part[goes_on]

    def _skip(self, g: GroupView) -> None:
        """Advance rows that have circled their waypoint, and say so."""
        self.turned += turn(self.last - self.goal, g.pos - self.goal)
        has_circled = (self.max_turns > 0.0) & (np.abs(self.turned) >= 2.0 * math.pi * self.max_turns)
        rows = np.flatnonzero(has_circled & ~self._is_last())
        if len(rows):
            self._advance(rows)
            # One text, so that Python shows it once.
            warnings.warn(
                f"{self.instance_name}: an entity skips a waypoint that it has circled without coming within its tolerance; "
                "it lies inside the turning circle (max_turns=0: circle it for ever)",
                RuntimeWarning,
                stacklevel=2,
            )

    def _is_last(self) -> np.ndarray:
        """Return whether no waypoint follows, (n,)."""
        n_points = self.waypoints.count
        is_end = (n_points <= 1) | (self.mode == "stop") & (self.current + 1 >= n_points)
        return np.asarray(self.is_told | is_end)

    def _advance(self, rows: np.ndarray) -> None:
        """Select the next waypoint of rows."""
        self.turned[rows] = 0.0
        n_points, back = self.waypoints.count[rows], self.is_returning[rows]
        if self.mode == "reverse":
            back = back ^ np.where(back, self.current[rows] == 0, self.current[rows] + 1 >= n_points)
        self.is_returning[rows] = back
        self.current[rows] = (self.current[rows] + np.where(back, -1, 1)) % n_points
        self.goal[:, rows] = self.waypoints.data[:, self.waypoints.start[rows] + self.current[rows]]

    def _command(self, g: GroupView, offset: np.ndarray, distance: np.ndarray) -> None:
        """Write the channels that are read."""
        is_last, wired = self._is_last(), self.wired
        slowed = self.speed * np.minimum(1.0, distance / np.maximum(self.slowing_distance, 1e-9))
        speed = np.where(is_last, np.minimum(slowed, distance / g.dt), self.speed)
        if "position" in wired:
            self.position[:] = self.goal
        if "velocity" in wired:
            self.velocity[:] = speed * unit(offset)
        if not wired.isdisjoint(("desired_heading", "desired_altitude", "desired_speed")):
            rests = is_last & (distance <= self.tolerance)
            east, north, _ = offset
            turns = ~rests & ((east != 0.0) | (north != 0.0))
            self.heading[:] = np.where(turns, atan2(north, east), self.heading)
            self.desired_heading[:], self.desired_altitude[:] = self.heading, self.goal[2]
            self.desired_speed[:] = np.where(rests, 0.0, speed)
