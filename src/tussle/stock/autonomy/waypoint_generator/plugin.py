"""Says where to go, when it is time."""

from __future__ import annotations

import numpy as np

from tussle.api import Autonomy, GroupView, Param, Publish, RaggedColumn, State
from tussle.messages import WAYPOINT_MODES, WaypointList

FIELDS = "frame time a b c roll pitch yaw position_tolerance turn_tolerance"
UNITS = "1 s 1 1 1 rad rad rad m rad"
GEODETIC = 1.0
NEVER = -1e300


class WaypointGenerator(Autonomy):
    """Publishes its waypoints when their times have come, all that are due in one list.

    A waypoint is `frame` (0: a b c are x, y, z [m] in the world frame; 1: latitude and longitude [rad] and altitude [m]), the time at
    which it is told, the place, roll, pitch and yaw there, and how near is near enough; a negative tolerance is any distance. Places
    travel in the world frame. The third default waypoint lies at the origin, which the existing system wrote as the latitude and
    longitude of a place in California.
    """

    grade = "portable"

    waypoints = Param(
        (
            (0.0, 0.0, 100.0, 0.0, 100.0, 0.0, 0.0, 0.0, 5.0, -1.0),
            (0.0, 0.0, 300.0, 300.0, 100.0, 0.0, 0.0, 0.0, 5.0, -1.0),
            (0.0, 50.0, 0.0, 0.0, 100.0, 0.0, 0.0, 0.0, 5.0, -1.0),
        ),
        fields=FIELDS,
        unit=UNITS,
        text_unit="1 s 1 1 1 deg deg deg m rad",
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
        is_due = (data[1] > self.told[owner]) & (data[1] <= now[owner])
        self.told[:] = now
        if is_due.any():
            count = np.bincount(owner[is_due], minlength=g.n)
            rows = np.flatnonzero(count)
            points = RaggedColumn(
                np.concatenate([[0], np.cumsum(count[rows])]), self._points(g, data[:, is_due])
            )
            self.lists.publish(rows, points=points, mode=WAYPOINT_MODES.index(self.mode))

    def _points(self, g: GroupView, data: np.ndarray) -> np.ndarray:
        """Waypoints as messages carry them, (8, m)."""
        is_geodetic = data[0] == GEODETIC
        place = data[2:5].copy()
        if is_geodetic.any():
            place[:, is_geodetic] = g.scene.origin.from_geodetic(place[:, is_geodetic])
        tolerance = np.where(data[8:10] < 0.0, np.inf, data[8:10])
        return np.ascontiguousarray(np.concatenate([place, data[5:8], tolerance]))
