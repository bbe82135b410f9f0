"""Waypoint following with a lead point."""

from __future__ import annotations

import math
import warnings

import numpy as np

from tussle.api import (
    Autonomy,
    GroupView,
    Messages,
    Param,
    Publish,
    State,
    Subscribe,
    unit,
)
from tussle.declare.messages import WAYPOINT_MODES, Waypoint, WaypointList, WaypointStatus
from tussle.numeric.ways import closest_approach, is_passed, turn

FOLLOW_ONCE, BACK_AND_FORTH, LOITER, RACETRACK = range(len(WAYPOINT_MODES))


class WaypointDispatcher(Autonomy):
    """Follows a list of waypoints: publishes a `Waypoint` on the line from the last waypoint to the next.

    The point lies `lead_distance` ahead of the entity's projection onto the line, but never beyond the next waypoint. When the
    straight way since the last step comes within the tolerance of a waypoint, or, if that is 0, comes nearer and then no more, the next
    one becomes current, and a `WaypointStatus` is published; several may be passed in one step. A waypoint that the entity has circled
    `max_turns` times without reaching it, since it lies inside the turning circle, is skipped: the status says so, and a warning is
    given. The list is flown once, back and forth, or as a closed circuit (racetrack). With loiter it is flown once; then the entity
    circles around the last waypoint, counter-clockwise at `loiter_radius`: the point lies `lead_distance` ahead on the tangent of that
    circle. A new list starts at its first waypoint. Until that is reached, and at the end of a list, the line starts at the entity itself.

    In SCRIMMAGE a waypoint was reached only if the entity was within the tolerance at the end of a step, and none was skipped. It
    published its status in every step at the end of a list, stayed one step longer at the turning points of
    back_and_forth, and had no loiter.
    """

    grade = "portable"

    lead_distance = Param(50.0, unit="m", ge=0.0, doc="Distance from the projection to the published point.")
    filter_dist = Param(
        1.0, unit="m", ge=0.0, doc="Waypoints nearer than this to their predecessor are dropped."
    )
    loiter_radius = Param(50.0, unit="m", ge=0.0, doc="Radius of the circle with the mode loiter.")
    tolerance_in_2d = Param(False, doc="Measure tolerances in the horizontal plane.")
    max_turns = Param(
        1.0, ge=0.0, doc="Turns round a waypoint, seen from above, after which it is skipped; 0: it never is."
    )
    waypointlist_network = Param("GlobalNetwork", doc="Network of the waypoint lists.")
    waypoint_network = Param("LocalNetwork", doc="Network of the published waypoint and status.")
    points = State("x y z tolerance", unit="m", ragged=True, doc="Current list.")
    mode = State(dtype=int, doc="What to do at the end of the list, an index into WAYPOINT_MODES.")
    current = State(dtype=int, doc="Index of the next waypoint.")
    previous = State(dtype=int, doc="Index of the last waypoint; equal to `current` if there is none.")
    is_returning = State(dtype=bool, doc="Whether the list is flown backwards.")
    is_done = State(dtype=bool, doc="Whether a list that is flown once is finished.")
    last = State("x y z", unit="m", doc="Position in the last step.")
    turned = State(unit="rad", doc="Angle by which the entity has gone round the current waypoint.")
    lists = Subscribe(WaypointList, network_param="waypointlist_network")
    goal = Publish(Waypoint, network_param="waypoint_network")
    status = Publish(WaypointStatus, network_param="waypoint_network")

    def step(self, g: GroupView) -> None:
        if self.lists:
            rows, messages = self.lists.latest()
            self._start_lists(rows, messages)
            self.last[:, rows], self.turned[rows] = g.pos[:, rows], 0.0
        rows = np.flatnonzero(self.points.count)
        if not len(rows):
            return
        first, data = self.points.start[rows], self.points.data
        pos = g.pos[:, rows]
        target = data[:3, first + self.current[rows]]
        has_line = self.previous[rows] != self.current[rows]
        begin = np.where(has_line, data[:3, first + self.previous[rows]], pos)
        line, way = target - begin, pos - begin
        length = np.sqrt(line[0] * line[0] + line[1] * line[1] + line[2] * line[2])
        direction = unit(line)
        along = direction[0] * way[0] + direction[1] * way[1] + direction[2] * way[2]
        ahead = np.maximum(along, 0.0) + self.lead_distance[rows]
        goal = np.where(ahead >= length, target, begin + direction * ahead)
        circles = (self.mode[rows] == LOITER) & self.is_done[rows]
        self.goal.publish(rows, pos=np.where(circles, self._on_tangent(rows, pos, target), goal))
        self._pass(rows, self._way_begin(g)[:, rows], pos)
        self._skip(rows, self.last[:, rows], pos)
        self.last[:, rows] = pos

    def _way_begin(self, g: GroupView) -> np.ndarray:
        """Where the ways begin on which waypoints are reached [m], (3, n)."""
        return np.asarray(self.last)

    def _pass(self, rows: np.ndarray, begin: np.ndarray, end: np.ndarray) -> None:
        """Advance rows for the waypoints that their straight ways, (3, m) each, pass one after another."""
        part, is_first = np.zeros(len(rows)), True
        while len(rows):
            at = self.points.start[rows] + self.current[rows]
            target, tolerance = self.points.data[:3, at], self.points.data[3, at]
            offset, way = begin - target, end - begin
            flat = np.where(self.tolerance_in_2d[rows], 0.0, 1.0)
            offset[2], way[2] = flat * offset[2], flat * way[2]
            now, distance = closest_approach(offset, way, part)
            # After the first: those that are passed later.
            is_near = (distance <= tolerance) | ((tolerance == 0.0) & is_passed(offset, way))
            is_there = is_near & (is_first | (now > part))
            self._advance(rows[is_there])
            rows, begin, end, part = rows[is_there], begin[:, is_there], end[:, is_there], now[is_there]
            self.turned[rows] = 0.0
            is_first = False

    def _skip(self, rows: np.ndarray, begin: np.ndarray, end: np.ndarray) -> None:
        """Advance rows that have circled their waypoint, and say so."""
        target = self.points.data[:, self.points.start[rows] + self.current[rows]]
        self.turned[rows] += turn(begin - target[:3], end - target[:3])
        limit = self.max_turns[rows]
        has_circled = np.abs(self.turned[rows]) >= 2.0 * math.pi * limit
        rows = rows[has_circled & (limit > 0.0) & ~self.is_done[rows]]
        if len(rows):
            self._advance(rows, is_skipped=True)
            self.turned[rows] = 0.0
            # One text, so that Python shows it once.
            warnings.warn(
                f"{self.instance_name}: an entity skips a waypoint that it has circled without coming within its tolerance; "
                "it lies inside the turning circle (max_turns=0: circle it for ever)",
                RuntimeWarning,
                stacklevel=2,
            )

    def _on_tangent(self, rows: np.ndarray, pos: np.ndarray, center: np.ndarray) -> np.ndarray:
        """Points ahead on the tangents of circles, (3, m), at the feet of positions on them."""
        x, y = pos[:2] - center[:2]
        distance = np.sqrt(x * x + y * y)
        is_center = distance == 0.0
        x, y = (
            np.where(is_center, at, v / np.where(is_center, 1.0, distance)) for at, v in ((1.0, x), (0.0, y))
        )
        radius, lead = self.loiter_radius[rows], self.lead_distance[rows]
        return np.stack([center[0] + radius * x - lead * y, center[1] + radius * y + lead * x, center[2]])

    def _start_lists(self, rows: np.ndarray, messages: Messages) -> None:
        """Start the lists that the rows received."""
        for number, row in enumerate(rows):
            points = messages.points[number]
            kept: list[int] = []
            for i in range(points.shape[1]):
                offset = points[:3, i] - points[:3, kept[-1]] if kept else None
                if offset is None or np.sqrt((offset * offset).cumsum()[-1]) >= self.filter_dist[row]:
                    kept.append(i)
            self.points[row] = points[[0, 1, 2, 6]][:, kept]
        self.mode[rows] = messages.mode
        self.current[rows] = self.previous[rows] = 0
        self.is_returning[rows] = self.is_done[rows] = False

    def _advance(self, rows: np.ndarray, is_skipped: bool = False) -> None:
        """Select the next waypoint of rows that have reached theirs, or skip it, and publish their status."""
        n_points = self.points.count[rows]
        mode, here = self.mode[rows], self.current[rows]
        turns_back = (mode == BACK_AND_FORTH) & np.where(
            self.is_returning[rows], here == 0, here + 1 == n_points
        )
        returning = self.is_returning[rows] ^ turns_back
        ends = ((mode == FOLLOW_ONCE) | (mode == LOITER)) & (here + 1 == n_points)
        after = np.where(returning, np.maximum(here - 1, 0), np.minimum(here + 1, n_points - 1))
        after = np.where(mode == RACETRACK, (here + 1) % n_points, after)
        is_changed = (after != here) | (ends & ~self.is_done[rows])
        self.previous[rows], self.current[rows] = here, after
        self.is_returning[rows], self.is_done[rows] = returning, ends
        rows = rows[is_changed]
        self.status.publish(
            rows,
            index=self.current[rows],
            n_waypoints=n_points[is_changed],
            is_done=self.is_done[rows],
            is_skipped=is_skipped,
        )
