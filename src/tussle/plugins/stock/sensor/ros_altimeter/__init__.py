"""ROSAltimeter: altitudes for nodes of ROS 1."""

from tussle.plugins.stock.sensor.ros_altimeter.plugin import ROSAltimeter

__all__ = ["ROSAltimeter"]
