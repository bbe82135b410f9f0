"""Arrivals: counts entities that reach their goals, and their times."""

from tussle.plugins.stock.metric.arrivals.plugin import Arrivals

__all__ = ["Arrivals"]
