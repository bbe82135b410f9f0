"""LOSSensor: a laser range finder."""

from tussle.stock.sensor.los_sensor.plugin import LOSSensor

__all__ = ["LOSSensor"]
