"""The direction of North for nodes of ROS 1, and what the compass of ROS 2 shares with it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar, NamedTuple

import numpy as np

from tussle.api import GroupView, Handle, HistoricAttributes, Param, Sensor
from tussle.numeric.quaternion import quat_rotate_inverse
from tussle.plugins.links.ros.link import RosLink
from tussle.plugins.links.ros.node import checked_namespace
from tussle.plugins.links.ros.steps import NodeLink


class CompassTopic(NamedTuple):
    """Topic of the measurements of one entity."""

    link: NodeLink
    publish: Callable[[Any, list[float]], None]


class CompassByROS(Sensor):
    """Columns and methods of compasses; abstract."""

    grade = "external"
    awaits = "ROS"
    link_type: ClassVar[type[NodeLink]] = RosLink
    """What connects it to ROS."""

    vehicle_name = Param("none", doc="Namespace; none for prefix and id.")
    ros_namespace_prefix = Param("robot", doc="Beginning of the namespace; the id follows.")
    topic = Handle(max_worlds=1, doc="Topic of the entity.")

    def open_one(self, row: Any) -> CompassTopic:
        """Announce the topic.

        Raises:
            MissingExtraError: rospy or Cyclone DDS is not installed.
            RosError: The master does not answer, or the domain cannot be joined.
            ParameterError: The namespace is no name of ROS.
        """
        link, own = self.link_type.of(row.shared), row.plugin.values
        given = own["vehicle_name"]
        name = checked_namespace(f"{own['ros_namespace_prefix']}{row.id}" if given == "none" else given)
        return CompassTopic(link, link.compass(f"{name}/compass", link.base_link(row.id, name)))

    def step(self, g: GroupView) -> None:
        """Publish the measurements."""
        topics: Any = self.topic
        north = np.zeros((3, g.n))
        north[1] = 1.0
        field = quat_rotate_inverse(g.quat, north)
        for row, (link, publish) in enumerate(topics):
            if link.lost:
                g.fail(row, link.lost)
            publish(link.stamp(float(g.t[row])), field[:, row].tolist())


class ROSCompass(CompassByROS):
    """Publishes the unit vector to the North in the body frame on compass (sensor_msgs/MagneticField), in the robot's namespace.

    The namespace is `vehicle_name`, or `ros_namespace_prefix` followed by the id if that is none. The frame is the base_link of
    the robot's `ROSAutonomy`; without one, that of its own namespace. The measurement has no errors, and its size is no field strength.

    Raises:
        MissingExtraError: rospy is not installed.
        RosError: No ROS master answers.
    """

    historic_attributes = HistoricAttributes()
