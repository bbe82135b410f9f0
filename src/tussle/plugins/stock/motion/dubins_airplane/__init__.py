"""DubinsAirplane: an aeroplane that follows a speed, an elevation and a bank."""

from tussle.plugins.stock.motion.dubins_airplane.plugin import DubinsAirplane

__all__ = ["DubinsAirplane"]
