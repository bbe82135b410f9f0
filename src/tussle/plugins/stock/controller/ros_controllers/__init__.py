"""RigidBody6DOFControllerROS and FixedWing6DOFControllerROS: surfaces and thrust by cmd_vel of ROS 1."""

from tussle.plugins.stock.controller.ros_controllers.plugin import (
    FixedWing6DOFControllerROS,
    RigidBody6DOFControllerROS,
)

__all__ = ["FixedWing6DOFControllerROS", "RigidBody6DOFControllerROS"]
