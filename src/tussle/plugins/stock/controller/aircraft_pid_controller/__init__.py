"""AircraftPIDController: controls heading, altitude and speed by the surfaces of an aircraft."""

from tussle.plugins.stock.controller.aircraft_pid_controller.plugin import AircraftPIDController

__all__ = ["AircraftPIDController"]
