"""Specific force and rotation for nodes of ROS 1, and what the sensor of ROS 2 shares with it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar, NamedTuple

import numpy as np

from tussle.api import GroupView, Handle, Param, Sensor, State
from tussle.numeric.quaternion import quat_rotate_inverse
from tussle.plugins.links.ros.link import RosLink
from tussle.plugins.links.ros.node import checked_namespace
from tussle.plugins.links.ros.steps import NodeLink

GRAVITY = 9.80665  # [m/s^2], standard acceleration of gravity (CGPM 1901)


class ImuTopic(NamedTuple):
    """Topic of the measurements of one entity."""

    link: NodeLink
    publish: Callable[..., None]


class ImuByROS(Sensor):
    """Columns and methods of inertial sensors; abstract."""

    grade = "external"
    awaits = "ROS"
    link_type: ClassVar[type[NodeLink]] = RosLink
    """What connects it to ROS."""

    vehicle_name = Param("none", doc="Namespace; none for prefix and id.")
    ros_namespace_prefix = Param("robot", doc="Beginning of the namespace; the id follows.")
    acceleration_bias = Param(0.0, unit="m/s^2", ge=0.0, doc="Standard deviation of the bias of each axis.")
    acceleration_noise = Param(
        0.0, unit="m/s^2", ge=0.0, doc="Standard deviation of the noise of a measurement."
    )
    rate_bias = Param(0.0, unit="rad/s", ge=0.0, doc="Standard deviation of the bias of each axis.")
    rate_noise = Param(0.0, unit="rad/s", ge=0.0, doc="Standard deviation of the noise of a measurement.")
    bias = State("ax ay az wx wy wz", unit="m/s^2 m/s^2 m/s^2 rad/s rad/s rad/s", doc="Biases, body frame.")
    last_vel = State("x y z", unit="m/s", doc="Velocity at the last measurement, world frame.")
    topic = Handle(max_worlds=1, doc="Topic of the entity.")

    def open_one(self, row: Any) -> ImuTopic:
        """Announce the topic.

        Raises:
            MissingExtraError: rospy or Cyclone DDS is not installed.
            RosError: The master does not answer, or the domain cannot be joined.
            ParameterError: The namespace is no name of ROS.
        """
        link, own = self.link_type.of(row.shared), row.plugin.values
        given = own["vehicle_name"]
        name = checked_namespace(f"{own['ros_namespace_prefix']}{row.id}" if given == "none" else given)
        return ImuTopic(link, link.imu(f"{name}/imu", link.base_link(row.id, name)))

    def spawn(self, g: GroupView, rows: np.ndarray) -> None:
        """Draw the biases."""
        draws = g.normal("bias", 6)[:, rows]
        self.bias[:3, rows] = self.acceleration_bias[rows] * draws[:3]
        self.bias[3:, rows] = self.rate_bias[rows] * draws[3:]
        self.last_vel[:, rows] = g.vel[:, rows]

    def step(self, g: GroupView) -> None:
        """Publish the measurements."""
        topics: Any = self.topic
        noise = g.normal("noise", 6)
        acceleration = (g.vel - self.last_vel) / g.dt
        acceleration[2] += GRAVITY
        force = (
            quat_rotate_inverse(g.quat, acceleration) + self.bias[:3] + self.acceleration_noise * noise[:3]
        )
        rate = quat_rotate_inverse(g.quat, g.omega) + self.bias[3:] + self.rate_noise * noise[3:]
        self.last_vel[:] = g.vel
        variances = np.stack([
            self.rate_bias**2 + self.rate_noise**2, self.acceleration_bias**2 + self.acceleration_noise**2
        ])  # fmt: skip
        for row, (link, publish) in enumerate(topics):
            if link.lost:
                g.fail(row, link.lost)
            columns = g.quat, rate, force, variances
            publish(link.stamp(float(g.t[row])), *(column[:, row].tolist() for column in columns))


class ROSIMUSensor(ImuByROS):
    """Publishes specific force, angular velocity and attitude on imu (sensor_msgs/Imu), in the robot's namespace.

    Specific force is the mean acceleration since the last measurement less gravity, and both vectors are in the body frame; a body at
    rest measures 9.80665 m/s^2 upward. Errors: a constant bias of each axis, drawn at birth, and white noise; the covariances are theirs.
    The attitude is that of the body in the world frame, without errors. The frame is the base_link of the robot's `ROSAutonomy`;
    without one, that of its own namespace.

    The existing system publishes velocity and angle increments with the rotation of the Earth in fields of accelerations and rates,
    without errors.

    Raises:
        MissingExtraError: rospy is not installed.
        RosError: No ROS master answers.
    """
