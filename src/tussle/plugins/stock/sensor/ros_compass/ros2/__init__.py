"""ROS2Compass: the direction of North for nodes of ROS 2."""

from tussle.plugins.stock.sensor.ros_compass.ros2.plugin import ROS2Compass

__all__ = ["ROS2Compass"]
