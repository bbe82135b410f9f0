"""GoToWaypoint: publishes one waypoint."""

from tussle.stock.autonomy.go_to_waypoint.plugin import GoToWaypoint

__all__ = ["GoToWaypoint"]
