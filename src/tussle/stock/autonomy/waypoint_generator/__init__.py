"""WaypointGenerator: publishes waypoints at given times."""

from tussle.stock.autonomy.waypoint_generator.plugin import WaypointGenerator

__all__ = ["WaypointGenerator"]
