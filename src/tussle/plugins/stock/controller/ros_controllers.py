"""Surfaces and thrust by cmd_vel of ROS 1."""

from __future__ import annotations

from typing import Any

from tussle.api import Controller, GroupView, Handle, Output, Param
from tussle.plugins.links.ros.link import RosLink
from tussle.plugins.links.ros.node import checked_namespace
from tussle.plugins.links.ros.robot import TwistInbox


class SurfacesByROS(Controller):
    """Columns and methods of both plugins; abstract."""

    grade = "external"
    awaits = "ROS"

    namespace_prefix = Param(
        "",
        doc="Beginning of the namespace of cmd_vel, which the id follows; empty for the topic cmd_vel, which all hear.",
    )
    elevator = Output(doc="angular.y.")
    aileron = Output(doc="angular.x.")
    rudder = Output(doc="angular.z.")
    inbox = Handle(max_worlds=1, doc="Commands of the entity.")

    def open_one(self, row: Any) -> TwistInbox:
        """Subscribe to the commands.

        Raises:
            MissingExtraError: rospy is not installed.
            RosError: The master does not answer.
            ParameterError: The namespace is no name of ROS.
        """
        prefix = row.plugin.values["namespace_prefix"]
        topic = f"{checked_namespace(f'{prefix}{row.id}')}/cmd_vel" if prefix else "cmd_vel"
        return TwistInbox(RosLink.of(row.shared), topic)

    def step(self, g: GroupView) -> None:
        """Write the newest commands to the channels."""
        inboxes: Any = self.inbox
        push: Any = self.thrust_channel()
        for row, inbox in enumerate(inboxes):
            if fault := inbox.fault or inbox.link.lost:
                g.fail(row, fault)
            forward, _, _, self.aileron[row], self.elevator[row], self.rudder[row] = inbox.command
            push[row] = forward

    def thrust_channel(self) -> Any:
        """Return the output that linear.x sets."""
        raise TypeError(f"{type(self).__name__} has no thrust")


class RigidBody6DOFControllerROS(SurfacesByROS):
    """Flies a `RigidBody6DOF` by cmd_vel of ROS 1: linear.x is the thrust [N], angular the torques [N m] of aileron, elevator, rudder.

    Without a command all are 0. The existing system computes these inputs and passes them to nobody.

    Raises:
        MissingExtraError: rospy is not installed.
        RosError: No ROS master answers.
    """

    thrust = Output(doc="linear.x.")

    def thrust_channel(self) -> Any:
        """Return the thrust."""
        return self.thrust


class FixedWing6DOFControllerROS(SurfacesByROS):
    """Flies a `FixedWing6DOF` by cmd_vel of ROS 1: linear.x is the throttle, angular the angles [rad] of aileron, elevator, rudder.

    Without a command all are 0.

    Raises:
        MissingExtraError: rospy is not installed.
        RosError: No ROS master answers.
    """

    throttle = Output(doc="linear.x.")

    def thrust_channel(self) -> Any:
        """Return the throttle."""
        return self.throttle
