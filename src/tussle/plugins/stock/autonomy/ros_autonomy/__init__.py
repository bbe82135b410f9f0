"""ROSAutonomy and ROSControl: robots that are driven by nodes of ROS 1."""

from tussle.plugins.stock.autonomy.ros_autonomy.plugin import ROSAutonomy, ROSControl

__all__ = ["ROSAutonomy", "ROSControl"]
