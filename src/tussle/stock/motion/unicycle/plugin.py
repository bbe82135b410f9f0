"""The unicycle of the paper's equation (1), with pitch up positive."""

from __future__ import annotations

from typing import Any

import numpy as np

from tussle.api import HistoricAttributes, Input, MotionBody, MotionModel, Param, State
from tussle.numeric import cos, sin
from tussle.stock.motion.unicycle import kernels


class Unicycle(MotionModel):
    """A vehicle that moves where its nose points; speed, turn rate and pitch rate are commanded and followed at once.

    DeMarco, Squires, Day, Pippin 2018, equation (1): x' = v cos(pitch) cos(yaw), y' = v cos(pitch) sin(yaw), z' = v
    sin(pitch), yaw' = turn_rate, pitch' = pitch_rate, with pitch nose up and every command held within its limit.
    Without `use_pitch` the pitch stays as it was placed and z' = velocity_z.

    The existing system turned the sign of z' (since May 2020) but not that of the behaviours that fly it, so pursuers
    dived, looped and flew on upside down; here climbing is nose up throughout. Its mission files mean use_pitch =
    false where they say nothing; here the paper's model is the default. Like there, `vel` is the displacement of the
    last substep over its length (exactly what a camera would see between two substeps), which lags the heading by
    half a substep of turn. Unlike there, a row that someone else moves (teleport, wall) goes on from where it was
    put, and `omega` is filled.
    """

    grade = "portable"
    historic_attributes = HistoricAttributes(
        differs={
            "use_pitch": "Unicycle is steered in pitch here unless use_pitch='false' is written; "
            "in the existing system only with use_pitch='true'"
        }
    )

    vel_max = Param(1.0, unit="m/s", ge=0.0, doc="Limit of the speed, forwards and backwards.")
    turn_rate_max = Param(1.0, unit="rad/s", ge=0.0, doc="Limit of the turn rate.")
    pitch_rate_max = Param(1.0, unit="rad/s", ge=0.0, doc="Limit of the pitch rate.")
    velocity_z_max = Param(0.0, unit="m/s", ge=0.0, doc="Limit of the climb speed without use_pitch.")
    use_pitch = Param(True, structural=True, doc="Steered by pitch_rate; else level with a climb speed.")
    enable_roll = Param(
        False, structural=True, doc="Show the bank of a coordinated turn; the path is the same."
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
        """The third input is pitch_rate or velocity_z."""
        return ["speed", "turn_rate", "pitch_rate" if self.use_pitch else "velocity_z"]

    @property
    def advance(self) -> Any:
        """Kernel of the structural variant."""
        return kernels.advance_pitch if self.use_pitch else kernels.advance_level

    def from_body(self, body: MotionBody, rows: np.ndarray) -> None:
        """Take position, heading and elevation over."""
        self.x[:3, rows] = body.pos[:, rows]
        self.x[3, rows] = body.yaw[rows]
        self.x[4, rows] = body.climb[rows]

    def to_body(self, body: MotionBody) -> None:
        """Publish position, attitude, velocity and turn rate."""
        pitches = self.use_pitch
        third = self.pitch_rate if pitches else self.velocity_z
        third_max = self.pitch_rate_max if pitches else self.velocity_z_max
        commands = self.speed, self.turn_rate, third
        limits, flags = (self.vel_max, self.turn_rate_max, third_max), (pitches, self.enable_roll)
        body.split(
            lambda *part: kernels.to_body(
                self.x, commands, limits, flags, body.dt, body.table, body.first, part
            )
        )
