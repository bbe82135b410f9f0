"""Markers of RViz, in the viewer and from the simulation."""

from __future__ import annotations

from typing import Any

import numpy as np

from tussle.api import Interaction, Param, WorldView
from tussle.plugins.links.ros.link import RosLink
from tussle.plugins.links.ros.robot import ROOT

SPHERE, POINTS = 2, 8  # visualization_msgs/Marker
ADD = 0
MAX_MARKERS, MAX_POINTS = 1000, 100_000


class ROSShapeViz(Interaction):
    """Draws spheres and points of ROS nodes in the viewer, and publishes the entities as markers for RViz.

    Nodes send visualization_msgs/Marker of the types SPHERE and POINTS to `shapes`, in the world frame. A marker stays until one
    with the same namespace and id comes, or one with action DELETE. More than 1000 markers or 100,000 points of a marker
    are refused, and numbers that are not finite. The entities are published as spheres of their radius in a
    visualization_msgs/MarkerArray on tussle/markers, in the frame `frame`.

    The existing system keeps all markers, draws spheres black and points red, and publishes nothing.

    Raises:
        MissingExtraError: rospy is not installed.
        RosError: No ROS master answers.
    """

    grade = "external"
    awaits = "ROS"

    frame = Param(ROOT, doc="Frame of the published markers: the world frame.")

    def start(self, w: WorldView) -> None:
        """Connect the topics."""
        w.context.share("ROS shapes", lambda: ReceivedMarkers(RosLink.of(w.context.share)))

    def step(self, w: WorldView) -> None:
        """Draw what has come, and publish the entities of the first world."""
        received = w.context.share("ROS shapes", lambda: ReceivedMarkers(RosLink.of(w.context.share)))
        if w.n and (fault := received.fault or received.link.lost):
            w.fail(0, fault)
        for kind, shape in list(received.shapes.values()):
            getattr(w.draw, kind)(**shape)
        link: RosLink = received.link
        stamp, rows = link.stamp(float(w.t[0])), np.flatnonzero(w.world == 0)
        markers = []
        for number, pos, radius in zip(w.id[rows], w.pos[:, rows].T, w.radius[rows], strict=True):
            marker = link.ros.Marker(ns="entities", id=int(number), type=SPHERE, action=ADD)
            marker.header.stamp, marker.header.frame_id = stamp, self.frame
            marker.pose.position.x, marker.pose.position.y, marker.pose.position.z = pos.tolist()
            marker.pose.orientation.w = 1.0
            marker.scale.x = marker.scale.y = marker.scale.z = 2.0 * float(radius)
            marker.color.g = marker.color.a = 1.0
            markers.append(marker)
        link.publish("tussle/markers", link.ros.MarkerArray(markers))


class ReceivedMarkers:
    """Shapes that nodes have sent.

    Attributes:
        link: The link of the simulation.
        shapes: Namespace and id of a marker -> kind of shape and its attributes.
        fault: Why a marker is refused; empty without any.
    """

    def __init__(self, link: RosLink) -> None:
        self.link = link
        self.shapes: dict[tuple[str, int], tuple[str, dict[str, Any]]] = {}
        self.fault = ""
        link.advertise("tussle/markers", link.ros.MarkerArray)
        link.subscribe("shapes", link.ros.Marker, self._take, MAX_MARKERS)

    def _take(self, marker: Any) -> None:
        key = str(marker.ns), int(marker.id)
        if marker.action != ADD:
            self.shapes.pop(key, None)
            return
        places = marker.points if marker.type == POINTS else [marker.pose.position]
        colour = tuple(
            255.0 * min(max(part, 0.0), 1.0) for part in (marker.color.r, marker.color.g, marker.color.b)
        )
        if len(places) > MAX_POINTS or (len(self.shapes) >= MAX_MARKERS and key not in self.shapes):
            self.fault = f"/shapes: more than {MAX_MARKERS} markers or {MAX_POINTS} points of marker {key}"
            return
        pos = np.array([[p.x, p.y, p.z] for p in places]).reshape(-1, 3).T
        size = float(marker.scale.x)
        if not np.isfinite([*pos.ravel(), *colour, size]).all():
            self.fault = f"/shapes: marker {key} has a number that is not finite"
        elif marker.type == SPHERE:
            self.shapes[key] = "sphere", {"pos": pos, "radius": 0.5 * size, "colour": colour}
        elif marker.type == POINTS and len(places):
            self.shapes[key] = "points", {"pos": pos, "size": size, "colour": colour}

    def end(self) -> None:
        """Do nothing: the link withdraws the topics."""
