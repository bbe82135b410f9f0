"""ROS2IMUSensor: specific force and rotation for nodes of ROS 2."""

from tussle.plugins.stock.sensor.ros_imu_sensor.ros2.plugin import ROS2IMUSensor

__all__ = ["ROS2IMUSensor"]
