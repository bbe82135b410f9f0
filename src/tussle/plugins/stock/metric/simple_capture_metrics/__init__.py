"""Counts captures."""

from tussle.plugins.stock.metric.simple_capture_metrics.plugin import SimpleCaptureMetrics

__all__ = ["SimpleCaptureMetrics"]
