"""FlagCaptureMetrics: counts flags taken and captured."""

from tussle.plugins.stock.metric.flag_capture_metrics.plugin import FlagCaptureMetrics

__all__ = ["FlagCaptureMetrics"]
