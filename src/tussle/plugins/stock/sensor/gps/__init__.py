"""GPS: position by satellite, with denied regions."""

from tussle.plugins.stock.sensor.gps.plugin import GPS

__all__ = ["GPS"]
