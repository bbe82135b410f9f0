"""An autonomy that publishes waypoints at given times."""

from __future__ import annotations

import numpy as np

from tussle.api import Autonomy, GroupView, Param, Publish, RaggedColumn, State
from tussle.declare.messages import WAYPOINT_MODES, WaypointList

FIELDS = "time x y z roll pitch yaw position_tolerance turn_tolerance"
NEVER = -1e300


class WaypointGenerator(Autonomy):
    """Publishes each waypoint at its time; waypoints that are due in the same step form one list.

    A waypoint is a publication time, a position, roll, pitch and yaw, and the tolerances of position and turn; a negative tolerance
    accepts any distance. Positions are in the world frame. A mission file may give them as latitude, longitude and altitude, which are
    converted with the mission's origin. The third default waypoint lies at the origin; in SCRIMMAGE it was a place in
    California.
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
        doc="Waypoints, in the order of publication.",
    )
    mode = Param("follow_once", choices=WAYPOINT_MODES, doc="What to do at the end of the list.")
    network_name = Param("GlobalNetwork", doc="Network of the lists.")
    topic_name = Param("WaypointList", doc="Topic of the lists.")
    told = State(unit="s", default=NEVER, doc="Time up to which waypoints have been published.")
    lists = Publish(WaypointList, network_param="network_name", topic_param="topic_name")

    def _now(self, g: GroupView) -> np.ndarray:
        """Time up to which waypoints are due [s], (n,)."""
        return g.t + 1e-6 * g.dt  # a time written as a decimal number may lie just above that of the step

    def step(self, g: GroupView) -> None:
        now = self._now(g)
        start, data = self.waypoints.start, self.waypoints.data
        owner = np.repeat(np.arange(g.n), np.diff(start))
        is_due = (data[0] > self.told[owner]) & (data[0] <= now[owner])
        self.told[:] = now
        if is_due.any():
            count = np.bincount(owner[is_due], minlength=g.n)
            rows = np.flatnonzero(count)
            due = np.concatenate([data[1:7], np.where(data[7:] < 0.0, np.inf, data[7:])])[:, is_due]
            points = RaggedColumn(np.concatenate([[0], np.cumsum(count[rows])]), np.ascontiguousarray(due))
            self.lists.publish(rows, points=points, mode=WAYPOINT_MODES.index(self.mode))
