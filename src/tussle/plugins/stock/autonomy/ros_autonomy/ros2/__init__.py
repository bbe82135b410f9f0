"""ROS2Autonomy: robots that are driven by nodes of ROS 2."""

from tussle.plugins.stock.autonomy.ros_autonomy.ros2.plugin import ROS2Autonomy

__all__ = ["ROS2Autonomy"]
