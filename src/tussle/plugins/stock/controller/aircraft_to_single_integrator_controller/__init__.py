"""AircraftToSingleIntegratorController: flies a single integrator like an aircraft."""

from tussle.plugins.stock.controller.aircraft_to_single_integrator_controller.plugin import (
    AircraftToSingleIntegratorController,
)

__all__ = ["AircraftToSingleIntegratorController"]
