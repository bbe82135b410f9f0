"""A fixed-wing aircraft reduced to bank, elevation and speed."""

from __future__ import annotations

import math

import numpy as np

from tussle.api import Input, MotionBody, MotionModel, Param, State, row_law
from tussle.numeric import clip
from tussle.plugins.stock.motion.simple_aircraft import kernels


class SimpleAircraft(MotionModel):
    """A kinematic fixed-wing aircraft: it flies where its nose points, and its turn rate depends on bank and speed.

    x' = V cos(pitch) cos(yaw), y' = V cos(pitch) sin(yaw), z' = V sin(pitch), yaw' = V tan(roll) / L with the radius
    L = turning_radius + radius_slope_per_speed (V - speed_target), roll' = roll_rate, pitch' = pitch_rate, V' =
    throttle / 5; pitch is nose up. As in SCRIMMAGE, a positive roll (and roll_rate) turns to the left. The
    roll of the body attitude is positive right wing down, so it has the opposite sign.

    Limits hold at the end of every substep: a rate that would exceed a limit is reduced so that the substep ends at it.
    SCRIMMAGE clamped before each step, so its state could exceed a limit by one step. There, the z velocity
    had the wrong sign, a positive pitch_rate lowered the nose, and the initial velocity was horizontal for any pitch.
    """

    grade = "portable"
    only_calls_kernels = True

    turning_radius = Param(13.0, unit="m", gt=0.0, doc="Turn radius at 45 degrees of bank and speed_target.")
    min_velocity = Param(15.0, unit="m/s", ge=0.0, doc="Lowest speed.")
    max_velocity = Param(40.0, unit="m/s", ge=0.0, doc="Highest speed.")
    max_roll = Param(
        math.radians(30.0), unit="rad", text_unit="deg", ge=0.0, lt=math.pi / 2, doc="Largest bank."
    )
    max_pitch = Param(
        math.radians(30.0), unit="rad", text_unit="deg", ge=0.0, le=math.pi / 2, doc="Largest elevation."
    )
    max_roll_rate = Param(
        math.radians(57.3), unit="rad/s", text_unit="deg/s", ge=0.0, doc="Limit of roll_rate."
    )
    max_pitch_rate = Param(
        math.radians(57.3), unit="rad/s", text_unit="deg/s", ge=0.0, doc="Limit of pitch_rate."
    )
    speed_target = Param(50.0, unit="m/s", doc="Speed at which L is turning_radius.")
    radius_slope_per_speed = Param(0.0, unit="s", doc="Change of L with speed.")
    x = State(
        "x y z roll pitch yaw speed",
        unit="m m m rad rad rad m/s",
        doc="Position, bank (positive turns left), elevation (nose up), heading, speed.",
    )
    throttle = Input(doc="Five times the acceleration [m/s^2], clamped to [-100, 100].")
    roll_rate = Input(unit="rad/s", doc="Rate of the bank, positive into a left turn.")
    pitch_rate = Input(unit="rad/s", doc="Rate of the elevation, nose up positive.")

    flown = row_law("x", "pos_z", "vel", "yaw", "climb", "roll")(kernels.flown)

    def check_values(self) -> None:
        """Check that no lower limit is above its upper one."""
        self.check_order("min_velocity", "max_velocity")

    def from_body(self, body: MotionBody, rows: np.ndarray) -> None:
        """Copy position, attitude and speed, clamped to the limits."""
        vx, vy, vz = body.vel[:, rows]
        speed = np.sqrt(vx * vx + vy * vy + vz * vz)
        x = self.x
        x[:3, rows] = body.pos[:, rows]
        x[3, rows] = clip(-body.column("roll", rows), -self.max_roll[rows], self.max_roll[rows])
        x[4, rows] = clip(body.column("climb", rows), -self.max_pitch[rows], self.max_pitch[rows])
        x[5, rows] = body.column("yaw", rows)
        x[6, rows] = clip(speed, self.min_velocity[rows], self.max_velocity[rows])

    def to_body(self, body: MotionBody) -> None:
        """Write position, attitude, velocity and angular velocity."""
        rates = self.roll_rate, self.pitch_rate
        limits = self.max_roll, self.max_pitch, self.max_roll_rate, self.max_pitch_rate
        circle = self.turning_radius, self.radius_slope_per_speed, self.speed_target
        kernels.to_body(self.x, rates, limits, circle, body.table, body.first)
