"""GoToWaypoint: publishes one waypoint."""

from tussle.plugins.stock.autonomy.go_to_waypoint.plugin import GoToWaypoint

__all__ = ["GoToWaypoint"]
