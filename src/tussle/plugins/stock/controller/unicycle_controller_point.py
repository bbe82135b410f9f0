"""Feedback linearization that brings a unicycle to a point."""

from __future__ import annotations

from typing import Any

from tussle.api import Controller, Input, Output, Param, row_law
from tussle.numeric import sincos

STEEPEST = 0.05
"""Smallest cosine of the elevation that the turn rate is divided by: at a vertical nose no turn moves the point sideways."""


class UnicycleControllerPoint(Controller):
    """Brings the point at a distance `l` ahead of a unicycle to a point: its distance decays with the rate `gain`.

    The velocity gain (point - point ahead) is split along the body axes: v = e_forward, turn_rate = e_left / (l cos(pitch)),
    pitch_rate = e_up / l (input-output linearization: Siciliano et al. 2009, Robotics, equation 11.76, here with pitch). A unicycle
    that does not pitch takes velocity_z = gain (z error) instead.

    SCRIMMAGE takes the vehicle's own position instead of the point ahead, with which the distance need not decay to 0, and
    pitch_rate 0.
    """

    grade = "portable"

    l = Param(1.0, unit="m", gt=0.0, doc="Distance of the point ahead.")
    gain = Param(0.1, unit="1/s", ge=0.0, doc="Rate of decay of the distance.")
    point = Input("position_x position_y position_z", unit="m", doc="Point to go to, world frame.")
    speed = Output(unit="m/s", doc="Speed along the body x axis.")
    turn_rate = Output(unit="rad/s", doc="Turn rate, counter-clockwise positive.")
    pitch_rate = Output(unit="rad/s", doc="Rate of the elevation, nose up positive.")
    velocity_z = Output(unit="m/s", doc="Climb speed of a unicycle that does not pitch.")

    @row_law("speed", "turn_rate", "pitch_rate", "velocity_z")
    @staticmethod
    def pull(point: Any, pos: Any, yaw: float, climb: float, l: float, gain: float) -> Any:
        """Velocity of the point ahead, along the body axes."""
        (px, py, pz), (x, y, z) = point, pos
        (turn, ahead), (rise, level) = sincos(yaw), sincos(climb)
        ex, ey = gain * (px - x - l * level * ahead), gain * (py - y - l * level * turn)
        ez, along = gain * (pz - z - l * rise), ahead * ex + turn * ey
        turn_rate = (ahead * ey - turn * ex) / (l * max(level, STEEPEST))
        return level * along + rise * ez, turn_rate, (level * ez - rise * along) / l, gain * (pz - z)
