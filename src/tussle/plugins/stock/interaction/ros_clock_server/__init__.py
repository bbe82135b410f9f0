"""ROSClockServer: simulated time for nodes of ROS 1."""

from tussle.plugins.stock.interaction.ros_clock_server.plugin import ROSClockServer

__all__ = ["ROSClockServer"]
