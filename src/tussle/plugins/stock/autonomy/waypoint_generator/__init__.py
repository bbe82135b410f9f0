"""WaypointGenerator: publishes waypoints at given times."""

from tussle.plugins.stock.autonomy.waypoint_generator.plugin import WaypointGenerator

__all__ = ["WaypointGenerator"]
