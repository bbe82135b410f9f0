"""ROS2ClockServer: simulated time for nodes of ROS 2."""

from tussle.plugins.stock.interaction.ros_clock_server.ros2.plugin import ROS2ClockServer

__all__ = ["ROS2ClockServer"]
