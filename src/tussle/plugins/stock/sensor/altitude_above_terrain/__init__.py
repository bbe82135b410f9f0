"""AltitudeAboveTerrain: a radar altimeter."""

from tussle.plugins.stock.sensor.altitude_above_terrain.plugin import AltitudeAboveTerrain

__all__ = ["AltitudeAboveTerrain"]
