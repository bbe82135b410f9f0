"""A wanted velocity handed to a single integrator."""

from __future__ import annotations

from typing import ClassVar

from tussle.api import Controller, Input, Output


class SingleIntegratorControllerSimple(Controller):
    """Hands a wanted velocity through, unchanged: wiring, never called."""

    grade = "portable"
    passthrough: ClassVar[bool] = True

    wanted = Input("velocity_x velocity_y velocity_z", unit="m/s", doc="Wanted velocity, world frame.")
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s", doc="The same.")
