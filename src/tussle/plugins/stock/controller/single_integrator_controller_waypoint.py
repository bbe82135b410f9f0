"""A proportional law that brings a single integrator to a point."""

from __future__ import annotations

from typing import Any

from tussle.api import Controller, Input, Output, Param, row_law


class SingleIntegratorControllerWaypoint(Controller):
    """Brings a single integrator to a point: v = gain (point - position), so that the distance decays with the rate `gain`."""

    grade = "portable"

    gain = Param(1.0, unit="1/s", ge=0.0, doc="Rate of decay of the distance.")
    point = Input("position_x position_y position_z", unit="m", doc="Point to go to, world frame.")
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s", doc="Velocity, world frame.")

    @row_law("velocity")
    @staticmethod
    def pull(point: Any, pos: Any, gain: float) -> Any:
        """Proportional law of each axis."""
        (px, py, pz), (x, y, z) = point, pos
        return (gain * (px - x), gain * (py - y), gain * (pz - z))
