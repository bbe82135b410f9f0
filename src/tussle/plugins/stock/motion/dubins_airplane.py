"""An aeroplane that follows a speed, an elevation and a bank, within limits."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from tussle.api import Input, MotionBody, MotionModel, Param, State, row_law
from tussle.numeric import sincos
from tussle.numeric.paths import clamp, coordinated_turn

QUARTER = math.pi / 2


class DubinsAirplane(MotionModel):
    """An aeroplane in coordinated turns, whose speed, elevation and bank follow their commands without delay.

    x' = V cos(pitch) cos(yaw), y' = V cos(pitch) sin(yaw), z' = V sin(pitch), yaw' = -(g / V) tan(roll), with pitch nose up and roll
    right wing down (Owen, Beard, McLain 2015, "Implementing Dubins airplane paths on fixed-wing UAVs", equation 5). Helices are exact.
    Commands are clamped to their limits. A bank beyond 89 degrees turns like one of 89 degrees.

    In SCRIMMAGE a positive desired_pitch lowers the nose, and `vel` is the mean over the last substep.
    """

    grade = "portable"

    speed_max = Param(30.0, unit="m/s", doc="Largest speed.")
    speed_min = Param(-30.0, unit="m/s", doc="Smallest speed.")
    pitch_max = Param(QUARTER, unit="rad", text_unit="deg", ge=-QUARTER, le=QUARTER, doc="Largest elevation.")
    pitch_min = Param(
        -QUARTER, unit="rad", text_unit="deg", ge=-QUARTER, le=QUARTER, doc="Smallest elevation."
    )
    roll_max = Param(QUARTER, unit="rad", text_unit="deg", ge=-QUARTER, le=QUARTER, doc="Largest bank.")
    roll_min = Param(-QUARTER, unit="rad", text_unit="deg", ge=-QUARTER, le=QUARTER, doc="Smallest bank.")
    x = State(
        "x y z yaw pitch roll v yaw_rate",
        unit="m m m rad rad rad m/s rad/s",
        doc="Position, heading, elevation (nose up), bank (right wing down), speed, yaw rate.",
    )
    desired_speed = Input(unit="m/s", doc="Speed along the body x axis.")
    desired_pitch = Input(unit="rad", doc="Elevation, nose up positive.")
    desired_roll = Input(unit="rad", doc="Bank, right wing down positive.")

    def check_values(self) -> None:
        """Check that no lower limit is above its upper one."""
        self.check_order("speed_min", "speed_max")
        self.check_order("pitch_min", "pitch_max")
        self.check_order("roll_min", "roll_max")

    @row_law("x", "pos", "vel", "yaw", "climb", "roll")
    @staticmethod
    def flown(
        x: float, y: float, z: float, yaw: float, desired_speed: float, desired_pitch: float, desired_roll: float,
        speed_max: float, speed_min: float, pitch_max: float, pitch_min: float, roll_max: float, roll_min: float, dt: float,
    ) -> Any:  # fmt: skip
        """State and body after dt."""
        v, pitch = clamp(desired_speed, speed_min, speed_max), clamp(desired_pitch, pitch_min, pitch_max)
        return coordinated_turn(x, y, z, yaw, v, pitch, clamp(desired_roll, roll_min, roll_max), dt)

    def from_body(self, body: MotionBody, rows: np.ndarray) -> None:
        """Copy position, attitude, speed along the nose and yaw rate."""
        parts = [*body.pos, body.yaw, body.climb, body.roll, body.forward_speed, body.omega[2]]
        self.x[:, rows] = np.array(parts)[:, rows]

    def to_body(self, body: MotionBody) -> None:
        """Write position, velocity, attitude and yaw rate."""
        x = self.x
        (turn, rise), (ahead, level) = sincos(x[3:5])
        body.pos[:], body.omega[2] = x[:3], x[7]
        body.vel[:] = x[6] * np.array([level * ahead, level * turn, rise])
        body.set_attitude(x[5], x[4], x[3])
