"""SimpleINS: inertial navigation that drifts."""

from tussle.stock.sensor.simple_ins.plugin import SimpleINS

__all__ = ["SimpleINS"]
