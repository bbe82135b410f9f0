"""GPS: position by satellite, with denied regions."""

from tussle.stock.sensor.gps.plugin import GPS

__all__ = ["GPS"]
