"""Says where to go, when it is time."""

from tussle.stock.autonomy.waypoint_generator.plugin import WaypointGenerator

__all__ = ["WaypointGenerator"]
