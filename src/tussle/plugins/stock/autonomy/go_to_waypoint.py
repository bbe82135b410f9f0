"""An autonomy that publishes one waypoint, whose coordinates may be the entity's own."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from tussle.api import Autonomy, GroupView, Param, Publish, State
from tussle.declare.messages import WAYPOINT_MODES, WaypointList
from tussle.declare.texts import shown
from tussle.declare.units import parse
from tussle.errors import ParameterError

OWN = ("X", "Y", "Z")
PARTS = (
    ("s", "s"),
    ("m", "m"),
    ("m", "m"),
    ("m", "m"),
    ("rad", "deg"),
    ("rad", "deg"),
    ("rad", "deg"),
    ("m", "m"),
    ("rad", "deg"),
)
"""SI unit, and unit of a bare number, of time, position, roll, pitch, yaw, position tolerance and turn tolerance."""


class OwnWaypoint(NamedTuple):
    """A waypoint of the parameter `waypoint`.

    Attributes:
        is_geodetic: Its position is latitude and longitude [rad] and altitude [m].
        values: Its nine numbers; NaN for the entity's own coordinate.
    """

    is_geodetic: bool
    values: np.ndarray


def read_waypoint(text: str) -> OwnWaypoint:
    """Read "XYZ 0 X Y 0 0 0 0 10 -1" or "GPS 0 35.7 -120.8 Z 0 0 0 10 -1".

    Raises:
        ParameterError: The text has another form.
    """
    kind, *words = text.split() or [""]
    if kind not in ("XYZ", "GPS") or len(words) != len(PARTS):
        raise ParameterError(
            f"GoToWaypoint.waypoint = {shown(text)} is not allowed; it takes XYZ or GPS, time, position, roll, pitch, yaw, "
            "and the tolerances of position and turn; X, Y and Z are the entity's own coordinates"
        )
    parts = [*PARTS]
    if kind == "GPS":
        parts[1:3] = [("rad", "deg")] * 2
    is_own = [1 <= i <= 3 and word == OWN[i - 1] for i, word in enumerate(words)]
    if kind == "GPS" and (is_own[1] or is_own[2]):
        raise ParameterError(
            f"GoToWaypoint.waypoint = {shown(text)} is not allowed; only the altitude of a GPS position can be the entity's own, Z"
        )
    values = [
        math.nan if own else parse(word, *part) for own, word, part in zip(is_own, words, parts, strict=True)
    ]
    return OwnWaypoint(kind == "GPS", np.array(values))


class GoToWaypoint(Autonomy):
    """Publishes a list of one waypoint for the entity itself, once, at the time of the waypoint; WaypointDispatcher flies to it.

    The literals X, Y and Z stand for the entity's own coordinates when it publishes the list: with the default it goes to the ground
    below it. A negative tolerance accepts any distance. SCRIMMAGE published the list in every step.
    """

    grade = "portable"

    waypoint = Param(
        "XYZ 0 X Y 0 0 0 0 10 -1",
        doc="XYZ or GPS, time, position, roll, pitch, yaw [deg], tolerance of position and of turn.",
    )
    network_name = Param("LocalNetwork", doc="Network of the list.")
    is_told = State(dtype=bool, doc="Whether the list was published.")
    lists = Publish(WaypointList, network_param="network_name")

    def check_values(self) -> None:
        """Check the text of the waypoint."""
        read_waypoint(self.waypoint)

    def step(self, g: GroupView) -> None:
        is_geodetic, values = read_waypoint(self.waypoint)
        rows = np.flatnonzero(~self.is_told & (g.t + 1e-6 * g.dt >= values[0]))
        if not len(rows):
            return
        self.is_told[rows] = True
        own, given = g.pos[:, rows], values[1:4]
        is_own = np.isnan(given)
        pos = np.where(is_own, 0.0, given)
        if is_geodetic:
            pos = g.scene.origin.from_geodetic(pos)
        rest = np.append(values[4:7], np.where(values[7:] < 0.0, np.inf, values[7:]))
        points = np.concatenate(
            [np.where(is_own[:, None], own, pos[:, None]), np.broadcast_to(rest[:, None], (5, len(rows)))]
        )
        self.lists.publish(rows, points=list(points.T[:, :, None]), mode=WAYPOINT_MODES.index("follow_once"))
