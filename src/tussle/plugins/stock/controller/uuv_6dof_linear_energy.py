"""A battery discharged by the throttle."""

from __future__ import annotations

from typing import Any

import numpy as np

from tussle.api import Controller, GroupView, Input, Output, Param, State, row_law
from tussle.numeric import clip


class UUV6DOFLinearEnergy(Controller):
    """Passes throttle, elevator and rudder on, and discharges a battery: per second, by the absolute value of the throttle.

    When the energy is at energy_min, the throttle is 0.

    Differences from SCRIMMAGE: a negative throttle takes energy too (there, it charged the battery); the time step is that of
    the call; the energy starts within its limits and does not fall below them.
    """

    grade = "portable"

    energy_max = Param(5000.0, unit="s", ge=0.0, doc="Largest energy: seconds at full throttle.")
    energy_min = Param(0.0, unit="s", ge=0.0, doc="Energy of an empty battery.")
    energy_initial = Param(4000.0, unit="s", ge=0.0, doc="Energy at the start.")
    command = Input("throttle elevator rudder", doc="Commands.")
    passed = Output("throttle elevator rudder", doc="Commands passed on.")
    energy = State(unit="s", doc="Energy: seconds at full throttle.")

    def check_values(self) -> None:
        """Check that no lower limit is above its upper one."""
        self.check_order("energy_min", "energy_max")

    def spawn(self, g: GroupView, rows: np.ndarray) -> None:
        """Charge the battery."""
        self.energy[rows] = clip(self.energy_initial[rows], self.energy_min[rows], self.energy_max[rows])

    @row_law("passed", "energy")
    @staticmethod
    def deplete(command: Any, energy_min: float, energy: float, dt: float) -> Any:
        """Pass the commands, and reduce the energy."""
        throttle, elevator, rudder = command
        throttle = throttle if energy > energy_min else 0.0
        return (throttle, elevator, rudder), max(energy - abs(throttle) * dt, min(energy, energy_min))
