"""A pass-through controller for a single integrator."""

from __future__ import annotations

from typing import ClassVar

from tussle.api import Controller, Input, Output


class SingleIntegratorControllerSimple(Controller):
    """Passes a desired velocity through unchanged. It is wiring only and is never called."""

    grade = "portable"
    passthrough: ClassVar[bool] = True

    wanted = Input("velocity_x velocity_y velocity_z", unit="m/s", doc="Desired velocity, world frame.")
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s", doc="Commanded velocity, world frame.")
