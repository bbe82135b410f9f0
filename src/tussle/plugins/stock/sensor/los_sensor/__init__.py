"""LOSSensor: a laser range finder."""

from tussle.plugins.stock.sensor.los_sensor.plugin import LOSSensor

__all__ = ["LOSSensor"]
