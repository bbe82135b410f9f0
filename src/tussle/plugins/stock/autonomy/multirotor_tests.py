"""Constant pulse widths for the rotors of a multirotor."""

from __future__ import annotations

from tussle.api import Autonomy, GroupView, Output, Param


class MultirotorTests(Autonomy):
    """Writes the same pulse width for all rotors; a `MultirotorControllerOmega` passes them on."""

    grade = "portable"

    pwm = Param(1455.0, doc="Pulse width [us].")
    pulses = Output(" ".join(f"pwm_{i}" for i in range(8)), doc="Pulse widths of the rotors [us].")

    def step(self, g: GroupView) -> None:
        """Write the pulse widths."""
        self.pulses[:] = self.pwm
