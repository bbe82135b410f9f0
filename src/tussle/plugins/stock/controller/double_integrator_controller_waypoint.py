"""A PD law that brings a double integrator to a point."""

from __future__ import annotations

from typing import Any

from tussle.api import Controller, Input, Output, Param, row_law


class DoubleIntegratorControllerWaypoint(Controller):
    """Brings a double integrator to a point and to rest there: a = kp (point - position) - kd v, without turning.

    With the default gains both poles are at -1 /s: it comes without overshoot, unless the model limits its acceleration. The existing
    system takes the point from the autonomy's desired state; its parameter file cannot be read.
    """

    grade = "portable"

    gain = Param((1.0, 2.0), fields="kp kd", unit="1/s^2 1/s", ge=0.0, doc="Gains of position and velocity.")
    point = Input("position_x position_y position_z", unit="m", doc="Point to go to, world frame.")
    acceleration = Output(
        "acceleration_x acceleration_y acceleration_z", unit="m/s^2", doc="Acceleration, world frame."
    )
    turn_rate = Output(unit="rad/s", doc="Yaw rate: always 0.")

    @row_law("acceleration", "turn_rate")
    @staticmethod
    def pull(point: Any, pos: Any, vel: Any, gain: Any) -> Any:
        """PD law of each axis."""
        (px, py, pz), (x, y, z), (vx, vy, vz), (kp, kd) = point, pos, vel, gain
        return (kp * (px - x) - kd * vx, kp * (py - y) - kd * vy, kp * (pz - z) - kd * vz), 0.0
