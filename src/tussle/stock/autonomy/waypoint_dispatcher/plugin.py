"""Leads along a list of waypoints."""

from __future__ import annotations

import numpy as np

from tussle.api import (
    Autonomy,
    Batch,
    GroupView,
    Param,
    Publish,
    State,
    Subscribe,
    unit,
)
from tussle.messages import WAYPOINT_MODES, Waypoint, WaypointList, WaypointStatus

FOLLOW_ONCE, BACK_AND_FORTH, LOITER, RACETRACK = range(len(WAYPOINT_MODES))


class WaypointDispatcher(Autonomy):
    """Puts a point to go to (`Waypoint`) on the line from the last waypoint to the next, `lead_distance` ahead of the entity's foot on it.

    The point never lies beyond the next waypoint. Within a waypoint's tolerance the next one's turn comes, and that is told
    (`WaypointStatus`): once through the list, back and forth along it, or round and round it (racetrack); loiter stays with the first.
    A new list begins anew at its first waypoint; until that is reached, and where a list is at its end, the line is the one from the
    entity itself.

    The existing system told its status again in every step at the end of a list, and stayed a step longer at the turning points of
    back_and_forth.
    """

    grade = "portable"

    lead_distance = Param(50.0, unit="m", ge=0.0, doc="How far ahead of the foot on the line.")
    filter_dist = Param(
        1.0, unit="m", ge=0.0, doc="A waypoint nearer than this to the one before it is dropped."
    )
    tolerance_in_2d = Param(False, doc="Tolerances count in the plane only.")
    waypointlist_network = Param("GlobalNetwork", doc="Network that carries the lists.")
    waypoint_network = Param("LocalNetwork", doc="Network for the point to go to.")
    points = State("x y z tolerance", unit="m", ragged=True, doc="The list that is being flown.")
    mode = State(dtype=int, doc="What to do at its end, a number of WAYPOINT_MODES.")
    current = State(dtype=int, doc="Number of the next waypoint.")
    previous = State(dtype=int, doc="Number of the last one; the same where there is none.")
    is_returning = State(dtype=bool, doc="On the way back.")
    is_done = State(dtype=bool, doc="At the end of a list that is flown once.")
    lists = Subscribe(WaypointList, network_param="waypointlist_network")
    goal = Publish(Waypoint, network_param="waypoint_network")
    status = Publish(WaypointStatus, network_param="waypoint_network")

    def step(self, g: GroupView) -> None:
        if self.lists:
            self._take(*self.lists.latest())
        rows = np.flatnonzero(self.points.count)
        if not len(rows):
            return
        first, data = self.points.start[rows], self.points.data
        pos = g.pos[:, rows]
        target, tolerance = data[:3, first + self.current[rows]], data[3, first + self.current[rows]]
        has_line = self.previous[rows] != self.current[rows]
        begin = np.where(has_line, data[:3, first + self.previous[rows]], pos)
        line, way = target - begin, pos - begin
        length = np.sqrt(line[0] * line[0] + line[1] * line[1] + line[2] * line[2])
        direction = unit(line)
        foot = direction[0] * way[0] + direction[1] * way[1] + direction[2] * way[2]
        ahead = np.maximum(foot, 0.0) + self.lead_distance[rows]
        self.goal.publish(rows, pos=np.where(ahead >= length, target, begin + direction * ahead))
        dx, dy, dz = target - pos
        dz = np.where(self.tolerance_in_2d[rows], 0.0, dz)
        is_there = np.sqrt(dx * dx + dy * dy + dz * dz) <= tolerance
        self._advance(rows[is_there])

    def _take(self, rows: np.ndarray, heard: Batch) -> None:
        """Begin the lists that rows have heard."""
        for number, row in enumerate(rows):
            told = heard.points[number]
            kept: list[int] = []
            for i in range(told.shape[1]):
                offset = told[:3, i] - told[:3, kept[-1]] if kept else None
                if offset is None or np.sqrt((offset * offset).cumsum()[-1]) >= self.filter_dist[row]:
                    kept.append(i)
            self.points[row] = told[[0, 1, 2, 6]][:, kept]
        self.mode[rows] = heard.mode
        self.current[rows] = self.previous[rows] = 0
        self.is_returning[rows] = self.is_done[rows] = False

    def _advance(self, rows: np.ndarray) -> None:
        """Next waypoint of the rows that have reached theirs."""
        n_points = self.points.count[rows]
        mode, here = self.mode[rows], self.current[rows]
        turns_back = (mode == BACK_AND_FORTH) & np.where(
            self.is_returning[rows], here == 0, here + 1 == n_points
        )
        returning = self.is_returning[rows] ^ turns_back
        ends = (mode == FOLLOW_ONCE) & (here + 1 == n_points)
        after = np.where(returning, np.maximum(here - 1, 0), np.minimum(here + 1, n_points - 1))
        after = np.where(mode == RACETRACK, (here + 1) % n_points, np.where(mode == LOITER, here, after))
        tells = (after != here) | (ends & ~self.is_done[rows])
        self.previous[rows], self.current[rows] = here, after
        self.is_returning[rows], self.is_done[rows] = returning, ends
        rows = rows[tells]
        self.status.publish(
            rows, index=self.current[rows], n_waypoints=n_points[tells], is_done=self.is_done[rows]
        )
