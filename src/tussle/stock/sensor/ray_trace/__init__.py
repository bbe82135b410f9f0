"""RayTrace: a lidar."""

from tussle.stock.sensor.ray_trace.plugin import RayTrace

__all__ = ["RayTrace"]
