"""RayTrace: a lidar."""

from tussle.plugins.stock.sensor.ray_trace.plugin import RayTrace

__all__ = ["RayTrace"]
