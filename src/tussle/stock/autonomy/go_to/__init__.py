"""GoTo: goes to waypoints with any vehicle."""

from tussle.stock.autonomy.go_to.plugin import GoTo

__all__ = ["GoTo"]
