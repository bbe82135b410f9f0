"""SimpleAircraftControllerPID: flies a SimpleAircraft to a heading or bank, an altitude or slope, and a speed."""

from tussle.plugins.stock.controller.simple_aircraft_controller_pid.plugin import SimpleAircraftControllerPID

__all__ = ["SimpleAircraftControllerPID"]
