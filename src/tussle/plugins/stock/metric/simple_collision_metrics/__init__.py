"""Counts collisions and time in the air."""

from tussle.plugins.stock.metric.simple_collision_metrics.plugin import SimpleCollisionMetrics

__all__ = ["SimpleCollisionMetrics"]
