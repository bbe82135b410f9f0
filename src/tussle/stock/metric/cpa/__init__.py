"""CPA: closest point of approach."""

from tussle.stock.metric.cpa.plugin import CPA

__all__ = ["CPA"]
