"""ROSIMUSensor: specific force and rotation for nodes of ROS 1."""

from tussle.plugins.stock.sensor.ros_imu_sensor.plugin import ROSIMUSensor

__all__ = ["ROSIMUSensor"]
