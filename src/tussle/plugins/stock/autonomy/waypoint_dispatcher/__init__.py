"""WaypointDispatcher: follows a list of waypoints."""

from tussle.plugins.stock.autonomy.waypoint_dispatcher.plugin import WaypointDispatcher

__all__ = ["WaypointDispatcher"]
