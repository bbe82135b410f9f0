"""A constant acceleration command for an oscillator."""

from __future__ import annotations

from tussle.api import Controller, GroupView, Output, Param


class HarmonicOscillatorConstController(Controller):
    """Commands a constant `acceleration_z`. An oscillator settles at `acceleration_z` over its natural frequency squared."""

    grade = "portable"

    acceleration_z = Param(0.0, unit="m/s^2", doc="Vertical acceleration, up positive.")
    push = Output("acceleration_z", unit="m/s^2", doc="Commanded acceleration, up positive.")

    def step(self, g: GroupView) -> None:
        """Write the command."""
        self.push[:] = self.acceleration_z
