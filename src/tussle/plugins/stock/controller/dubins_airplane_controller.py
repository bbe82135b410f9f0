"""Heading, altitude and speed as bank, elevation and speed of a Dubins airplane."""

from __future__ import annotations

import math
from typing import Any

from tussle.api import Controller, Input, Output, Param, row_law
from tussle.numeric import atan2, wrap
from tussle.numeric.paths import GRAVITY, clamp


class DubinsAirplaneController(Controller):
    """Flies a DubinsAirplane to a heading and an altitude, and passes the desired speed through.

    The bank is that of a coordinated turn at a rate of heading_gain times the heading error, so that the error decays exponentially
    (Beard and McLain 2012, Small Unmanned Aircraft, equation 9.14); the climb speed is altitude_gain times the altitude error.
    """

    grade = "portable"

    heading_gain = Param(1.0, unit="1/s", ge=0.0, doc="Rate of decay of the heading error.")
    altitude_gain = Param(0.5, unit="1/s", ge=0.0, doc="Rate of decay of the altitude error.")
    max_roll = Param(
        math.radians(45.0), unit="rad", text_unit="deg", ge=0.0, lt=math.pi / 2, doc="Largest bank."
    )
    max_pitch = Param(
        math.radians(20.0), unit="rad", text_unit="deg", ge=0.0, le=math.pi / 2, doc="Largest elevation."
    )
    desired_altitude = Input(unit="m", doc="Desired height above the origin's tangent plane.")
    desired_speed = Input(unit="m/s", doc="Desired speed.")
    desired_heading = Input(unit="rad", doc="Desired heading, counter-clockwise from East.")
    speed = Output("desired_speed", unit="m/s", doc="Desired speed, passed through.")
    pitch = Output("desired_pitch", unit="rad", doc="Elevation, nose up positive.")
    roll = Output("desired_roll", unit="rad", doc="Bank, right wing down positive.")

    @row_law("desired_speed", "desired_pitch", "desired_roll")
    @staticmethod
    def steer(
        desired_altitude: float, desired_speed: float, desired_heading: float, pos_z: float, yaw: float, heading_gain: float,
        altitude_gain: float, max_roll: float, max_pitch: float,
    ) -> Any:  # fmt: skip
        """Bank of the turn, and elevation of the climb."""
        rate = heading_gain * wrap(desired_heading - yaw)
        bank = -atan2(desired_speed * rate, GRAVITY)
        climb = atan2(altitude_gain * (desired_altitude - pos_z), abs(desired_speed))
        return desired_speed, clamp(climb, -max_pitch, max_pitch), clamp(bank, -max_roll, max_roll)
