"""UUV6DOFLinearEnergy as in SCRIMMAGE."""

from __future__ import annotations

from typing import Any

import numpy as np

from tussle.api import GroupView, row_law
from tussle.plugins.stock.controller import uuv_6dof_linear_energy


class UUV6DOFLinearEnergy(uuv_6dof_linear_energy.UUV6DOFLinearEnergy):
    """UUV6DOFLinearEnergy that a negative throttle charges, without limits of the energy.

    The energy of a call counts in the same call. In tussle the size of the throttle is taken.
    """

    def spawn(self, g: GroupView, rows: np.ndarray) -> None:
        """Charge the battery."""
        self.energy[rows] = self.energy_initial[rows]

    @row_law("passed", "energy")
    @staticmethod
    def deplete(command: Any, energy_min: float, energy: float, dt: float) -> Any:
        """Take the energy, and pass the commands."""
        throttle, elevator, rudder = command
        left = energy - throttle * dt
        return (throttle if left > energy_min else 0.0, elevator, rudder), left
