"""ArduPilot: a vehicle is flown by ArduPilot's simulated flight controller."""

from tussle.plugins.stock.autonomy.ardupilot.plugin import ArduPilot

__all__ = ["ArduPilot"]
