"""GoTo: goes to waypoints with any vehicle."""

from tussle.plugins.stock.autonomy.go_to.plugin import GoTo

__all__ = ["GoTo"]
