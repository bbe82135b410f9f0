"""Heading, altitude and speed as the velocity of a single integrator."""

from __future__ import annotations

from tussle.api import Controller, Input, Output, row_law
from tussle.numeric import sincos

RATE = 1.0
"""Rate of decay of the altitude error [1/s]: of SCRIMMAGE."""


class AircraftToSingleIntegratorController(Controller):
    """Flies a single integrator by the commands of an aircraft: v = (speed cos(heading), speed sin(heading), altitude error / 1 s)."""

    grade = "portable"

    desired_altitude = Input(unit="m", doc="Desired height above the origin's tangent plane.")
    desired_speed = Input(unit="m/s", doc="Desired horizontal speed.")
    desired_heading = Input(unit="rad", doc="Desired heading, counter-clockwise from East.")
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s", doc="Velocity, world frame.")

    @row_law("velocity")
    @staticmethod
    def head(
        desired_altitude: float, desired_speed: float, desired_heading: float, pos_z: float
    ) -> tuple[float, float, float]:
        """Velocity towards the heading and the altitude."""
        sine, cosine = sincos(desired_heading)
        return desired_speed * cosine, desired_speed * sine, RATE * (desired_altitude - pos_z)
