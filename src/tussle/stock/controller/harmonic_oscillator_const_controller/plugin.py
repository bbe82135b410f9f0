"""A constant push on an oscillator."""

from __future__ import annotations

from tussle.api import Controller, GroupView, Output, Param


class HarmonicOscillatorConstController(Controller):
    """Writes a constant `acceleration_z`; an oscillator settles at that over its natural frequency squared."""

    grade = "portable"

    acceleration_z = Param(0.0, unit="m/s^2", doc="Push upwards, per mass.")
    push = Output("acceleration_z", unit="m/s^2", doc="The same at every call.")

    def step(self, g: GroupView) -> None:
        """Write the push."""
        self.push[:] = self.acceleration_z
