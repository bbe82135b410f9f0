"""SimpleINS: inertial navigation that drifts."""

from tussle.plugins.stock.sensor.simple_ins.plugin import SimpleINS

__all__ = ["SimpleINS"]
