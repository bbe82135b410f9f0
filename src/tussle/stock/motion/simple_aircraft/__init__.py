"""SimpleAircraft: an aircraft that turns by its bank, flown by roll rate, pitch rate and throttle."""

from tussle.stock.motion.simple_aircraft.plugin import SimpleAircraft

__all__ = ["SimpleAircraft"]
