"""Says where to go, when it is time."""

from __future__ import annotations

import numpy as np

from tussle.api import Autonomy, GroupView, Param, Publish, RaggedColumn, State
from tussle.messages import WAYPOINT_MODES, WaypointList

FIELDS = "time x y z roll pitch yaw position_tolerance turn_tolerance"
NEVER = -1e300


class WaypointGenerator(Autonomy):
    """Publishes its waypoints when their times have come, all that are due in one list.

    A waypoint is the time at which it is told, its place, roll, pitch and yaw there, and how near is near enough; a negative tolerance
    is any distance. Places are in the world frame: a mission file may write them as latitude, longitude and altitude, which its origin
    turns into that. The third default waypoint lies at the origin, which the existing system wrote as a place in California.
    """

    grade = "portable"

    waypoints = Param(
        (
            (0.0, 100.0, 0.0, 100.0, 0.0, 0.0, 0.0, 5.0, -1.0),
            (0.0, 300.0, 300.0, 100.0, 0.0, 0.0, 0.0, 5.0, -1.0),
            (50.0, 0.0, 0.0, 100.0, 0.0, 0.0, 0.0, 5.0, -1.0),
        ),
        fields=FIELDS,
        unit="s m m m rad rad rad m rad",
        text_unit="s m m m deg deg deg m rad",
        ragged=True,
        doc="What it tells, in order.",
    )
    mode = Param("follow_once", choices=WAYPOINT_MODES, doc="What is to be done at the end of the list.")
    network_name = Param("GlobalNetwork", doc="Network that carries the lists.")
    topic_name = Param("WaypointList", doc="Topic of the lists.")
    told = State(unit="s", default=NEVER, doc="Time up to which it has told everything.")
    lists = Publish(WaypointList, network_param="network_name", topic_param="topic_name")

    def step(self, g: GroupView) -> None:
        now = g.t + 1e-6 * g.dt  # a time that was written as a decimal number may lie just above a step's
        start, data = self.waypoints.start, self.waypoints.data
        owner = np.repeat(np.arange(g.n), np.diff(start))
        is_due = (data[0] > self.told[owner]) & (data[0] <= now[owner])
        self.told[:] = now
        if is_due.any():
            count = np.bincount(owner[is_due], minlength=g.n)
            rows = np.flatnonzero(count)
            told = np.concatenate([data[1:7], np.where(data[7:] < 0.0, np.inf, data[7:])])[:, is_due]
            points = RaggedColumn(np.concatenate([[0], np.cumsum(count[rows])]), np.ascontiguousarray(told))
            self.lists.publish(rows, points=points, mode=WAYPOINT_MODES.index(self.mode))
