"""ROSCompass: the direction of North for nodes of ROS 1."""

from tussle.plugins.stock.sensor.ros_compass.plugin import ROSCompass

__all__ = ["ROSCompass"]
