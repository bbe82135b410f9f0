"""AvoidWalls: a car that turns away from what its lidar sees."""

from tussle.plugins.stock.autonomy.avoid_walls.plugin import AvoidWalls

__all__ = ["AvoidWalls"]
