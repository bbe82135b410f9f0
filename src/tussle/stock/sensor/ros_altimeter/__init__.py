"""ROSAltimeter: altitudes for nodes of ROS 1."""

from tussle.stock.sensor.ros_altimeter.plugin import ROSAltimeter

__all__ = ["ROSAltimeter"]
