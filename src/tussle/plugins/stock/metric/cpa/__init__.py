"""CPA: closest point of approach."""

from tussle.plugins.stock.metric.cpa.plugin import CPA

__all__ = ["CPA"]
