"""The unicycle of equation (1) of the paper, with pitch nose up positive."""

from __future__ import annotations

import numpy as np

from tussle.api import HistoricAttributes, Input, MotionBody, MotionModel, Param, State, row_law
from tussle.numeric import cos, sin
from tussle.plugins.stock.motion.unicycle import kernels

SHOWN = "x", "pos_z", "vel", "yaw", "climb", "roll"


class Unicycle(MotionModel):
    """A vehicle that moves where its nose points and follows commanded speed, turn rate and pitch rate without delay.

    DeMarco, Squires, Day, Pippin 2018, equation (1): x' = v cos(pitch) cos(yaw), y' = v cos(pitch) sin(yaw), z' = v
    sin(pitch), yaw' = turn_rate, pitch' = pitch_rate, with pitch nose up and every command clamped to its limit.
    Without `use_pitch` the pitch does not change and z' = velocity_z. `vel` is the displacement of the last substep over
    its duration, as in SCRIMMAGE; it lags the heading by half a substep of turn.

    Differences from SCRIMMAGE: there the sign of z' was changed in May 2020 but not in the behaviours, so
    pursuers dived, looped and flew upside down; here a climb is nose up everywhere. There `use_pitch` is false by
    default; here the model of the paper is the default. Here an entity that another plugin moves (teleport, wall)
    continues from its new position, and `omega` is written.
    """

    grade = "portable"
    only_calls_kernels = True
    historic_attributes = HistoricAttributes(
        differs={
            "use_pitch": "Unicycle follows pitch_rate unless use_pitch='false'; "
            "in SCRIMMAGE only with use_pitch='true'"
        }
    )

    vel_max = Param(1.0, unit="m/s", ge=0.0, doc="Limit of the speed, forwards and backwards.")
    turn_rate_max = Param(1.0, unit="rad/s", ge=0.0, doc="Limit of the turn rate.")
    pitch_rate_max = Param(1.0, unit="rad/s", ge=0.0, doc="Limit of the pitch rate.")
    velocity_z_max = Param(0.0, unit="m/s", ge=0.0, doc="Limit of the climb speed without use_pitch.")
    use_pitch = Param(True, structural=True, doc="Follow pitch_rate; else velocity_z at constant pitch.")
    enable_roll = Param(
        False, structural=True, doc="Bank the attitude as in a coordinated turn; the path does not change."
    )
    x = State(
        "x y z yaw pitch", unit="m m m rad rad", doc="Position, heading and elevation (nose up), world frame."
    )
    speed = Input(unit="m/s", doc="Speed along the body x axis.")
    turn_rate = Input(unit="rad/s", doc="Turn rate about the vertical, counter-clockwise positive.")
    pitch_rate = Input(unit="rad/s", doc="Rate of the elevation, nose up positive.")
    velocity_z = Input(unit="m/s", doc="Climb speed, without use_pitch.")

    @staticmethod
    def derivative(
        yaw: float,
        pitch: float,
        speed: float,
        turn_rate: float,
        pitch_rate: float,
        vel_max: float,
        turn_rate_max: float,
        pitch_rate_max: float,
    ) -> tuple[float, float, float, float, float]:
        """State equation with use_pitch: (x', y', z' [m/s], yaw', pitch' [rad/s])."""
        v = min(max(speed, -vel_max), vel_max)
        level = v * cos(pitch)
        return (
            level * cos(yaw),
            level * sin(yaw),
            v * sin(pitch),
            min(max(turn_rate, -turn_rate_max), turn_rate_max),
            min(max(pitch_rate, -pitch_rate_max), pitch_rate_max),
        )

    def active_inputs(self) -> list[str]:
        """Return speed, turn_rate, and pitch_rate or velocity_z."""
        return ["speed", "turn_rate", "pitch_rate" if self.use_pitch else "velocity_z"]

    pitched = row_law(*SHOWN)(kernels.pitched)
    level = row_law(*SHOWN)(kernels.level)

    def from_body(self, body: MotionBody, rows: np.ndarray) -> None:
        """Copy position, heading and elevation."""
        self.x[:3, rows] = body.pos[:, rows]
        self.x[3, rows] = body.column("yaw", rows)
        self.x[4, rows] = body.column("climb", rows)

    def to_body(self, body: MotionBody) -> None:
        """Write position, attitude, velocity and angular velocity."""
        pitches = self.use_pitch
        third = self.pitch_rate if pitches else self.velocity_z
        third_max = self.pitch_rate_max if pitches else self.velocity_z_max
        commands = self.speed, self.turn_rate, third
        limits, flags = (self.vel_max, self.turn_rate_max, third_max), (pitches, self.enable_roll)
        body.split(kernels.to_body, self.x, commands, limits, flags, body.dt, body.table, body.first)
