"""Counts captures."""

from tussle.stock.metric.simple_capture_metrics.plugin import SimpleCaptureMetrics

__all__ = ["SimpleCaptureMetrics"]
