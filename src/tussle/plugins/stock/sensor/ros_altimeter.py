"""Altitudes for nodes of ROS 1."""

from __future__ import annotations

import importlib
import sys
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from tussle.api import GroupView, Handle, HistoricAttributes, Param, Sensor, State
from tussle.plugins.links.ros.link import RosLink
from tussle.plugins.links.ros.node import checked_namespace, load_rospy
from tussle.plugins.links.ros.robot import height_above_floor


class AltimeterTopic(NamedTuple):
    """Topic of the measurements of one entity."""

    link: RosLink
    namespace: str
    message: Any


class ROSAltimeter(Sensor):
    """Publishes altitudes on altimeter (mavros_msgs/Altitude), in the robot's namespace.

    The namespace is `vehicle_name`, or `ros_namespace_prefix` followed by the id if that is none. The frame is the base_link of the
    robot's `ROSAutonomy`; without one, that of its own namespace.
    amsl is the altitude above the ellipsoid, as `altitude_origin` is; monotonic is amsl at birth; local is z in the world frame,
    relative the height above the place of birth; terrain and bottom_clearance are the height above the highest surface of the scene at
    the place, or above z = 0 without one. Errors, equal in all fields but monotonic: a constant bias, drawn at birth, and white noise.

    Raises:
        MissingExtraError: rospy is not installed.
        RosError: No ROS master answers.
    """

    grade = "external"
    awaits = "ROS"
    historic_attributes = HistoricAttributes()

    vehicle_name = Param("none", doc="Namespace; none for prefix and id.")
    ros_namespace_prefix = Param("robot", doc="Beginning of the namespace; the id follows.")
    bias = Param(0.0, unit="m", ge=0.0, doc="Standard deviation of the bias.")
    noise = Param(0.0, unit="m", ge=0.0, doc="Standard deviation of the noise of a measurement.")
    offset = State(unit="m", doc="Bias of the entity.")
    home = State("amsl z", unit="m m", doc="Altitude and z at birth.")
    topic = Handle(max_worlds=1, doc="Topic of the entity.")

    def open_one(self, row: Any) -> AltimeterTopic:
        """Announce the topic.

        Raises:
            MissingExtraError: rospy is not installed.
            RosError: The master does not answer.
            ParameterError: The namespace is no name of ROS.
        """
        link, own = RosLink.of(row.shared), row.plugin.values
        given = own["vehicle_name"]
        name = checked_namespace(f"{own['ros_namespace_prefix']}{row.id}" if given == "none" else given)
        type_ = altitude_type()
        link.advertise(f"{name}/altimeter", type_)
        message = type_()
        message.header.frame_id = link.base_link(row.id, name)
        return AltimeterTopic(link, name, message)

    def spawn(self, g: GroupView, rows: np.ndarray) -> None:
        """Draw the bias, and store the place of birth."""
        pos = g.pos[:, rows]
        self.offset[rows] = self.bias[rows] * g.normal("bias")[rows]
        self.home[:, rows] = g.scene.origin.to_geodetic(pos)[2], pos[2]

    def step(self, g: GroupView) -> None:
        """Publish the measurements."""
        topics: Any = self.topic
        above = height_above_floor(g.scene, g.pos)
        amsl = g.scene.origin.to_geodetic(g.pos)[2]
        altitudes = np.array([amsl, g.pos[2], g.pos[2] - self.home[1], above, above])
        altitudes += self.offset + self.noise * g.normal("noise")
        values = np.concatenate([self.home[:1], altitudes])
        for row, (link, name, message) in enumerate(topics):
            if link.lost:
                g.fail(row, link.lost)
            message.header.stamp = link.stamp(float(g.t[row]))
            for field, value in zip(FIELDS.split(), values[:, row].tolist(), strict=True):
                setattr(message, field, value)
            link.publish(f"{name}/altimeter", message)


ALTITUDE = "mavros_msgs/Altitude"
FIELDS = "monotonic amsl local relative terrain bottom_clearance"
"""Fields [m], of MAVLink's message ALTITUDE (https://mavlink.io/en/messages/common.html#ALTITUDE)."""


@cache
def altitude_type() -> Any:
    """The type, made from its definition: nodes that have it from MAVROS receive it as theirs.

    Raises:
        MissingExtraError: rospy is not installed.
    """
    load_rospy()
    before = list(sys.path)  # genpy adds a temporary folder
    try:
        dynamic = importlib.import_module("genpy.dynamic")
        lines = [
            "std_msgs/Header header",
            *(f"float32 {name}" for name in FIELDS.split()),
            "=" * 80,
            "MSG: std_msgs/Header",
            "uint32 seq",
            "time stamp",
            "string frame_id",
        ]
        return dynamic.generate_dynamic(ALTITUDE, "\n".join(lines) + "\n")[ALTITUDE]
    finally:
        sys.path[:] = before
