"""The direction of North for nodes of ROS 1."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from tussle.api import GroupView, Handle, HistoricAttributes, Param, Sensor
from tussle.numeric.quaternion import quat_rotate_inverse
from tussle.ros.link import RosLink
from tussle.ros.node import checked_namespace


class CompassTopic(NamedTuple):
    """Where the measurements of an entity go."""

    link: RosLink
    namespace: str
    message: Any


class ROSCompass(Sensor):
    """Publishes the unit vector to the North in the body frame on compass (sensor_msgs/MagneticField), in the robot's namespace.

    The namespace is `vehicle_name`, or `ros_namespace_prefix` followed by the id if that is none; the frame is its base_link.
    The measurement has no errors, and its size is no field strength.

    Raises:
        MissingExtraError: rospy is not installed.
        RosError: No ROS master answers.
    """

    grade = "external"
    historic_attributes = HistoricAttributes()

    vehicle_name = Param("none", doc="Namespace; none for prefix and id.")
    ros_namespace_prefix = Param("robot", doc="Beginning of the namespace; the id follows.")
    topic = Handle(max_worlds=1, doc="Topic of the entity.")

    def open_one(self, row: Any) -> CompassTopic:
        """Announce the topic.

        Raises:
            MissingExtraError: rospy is not installed.
            RosError: The master does not answer.
            ParameterError: The namespace is no name of ROS.
        """
        link, own = RosLink.of(row.shared), row.plugin.values
        given = own["vehicle_name"]
        name = checked_namespace(f"{own['ros_namespace_prefix']}{row.id}" if given == "none" else given)
        link.advertise(f"{name}/compass", link.ros.MagneticField)
        message = link.ros.MagneticField()
        message.header.frame_id = f"{name}/base_link"
        return CompassTopic(link, name, message)

    def step(self, g: GroupView) -> None:
        """Publish the measurements."""
        topics: Any = self.topic
        north = np.zeros((3, g.n))
        north[1] = 1.0
        field = quat_rotate_inverse(g.quat, north)
        for row, (link, name, message) in enumerate(topics):
            if link.lost:
                g.fail(row, link.lost)
            message.header.stamp = link.stamp(float(g.t[row]))
            message.magnetic_field.x, message.magnetic_field.y, message.magnetic_field.z = field[
                :, row
            ].tolist()
            link.publish(f"{name}/compass", message)
