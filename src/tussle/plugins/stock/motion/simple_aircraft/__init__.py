"""SimpleAircraft: a banking aircraft commanded by throttle, roll rate and pitch rate."""

from tussle.plugins.stock.motion.simple_aircraft.plugin import SimpleAircraft

__all__ = ["SimpleAircraft"]
