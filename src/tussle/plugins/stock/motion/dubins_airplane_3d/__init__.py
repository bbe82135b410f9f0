"""DubinsAirplane3D: an aeroplane that follows any speed, elevation and bank."""

from tussle.plugins.stock.motion.dubins_airplane_3d.plugin import DubinsAirplane3D

__all__ = ["DubinsAirplane3D"]
