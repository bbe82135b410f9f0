"""A motion model: the state equation of a robot."""

import numpy as np

from tussle.api import Input, MotionBody, MotionModel, Param, State
from tussle.numeric import cos, sin


class New(MotionModel):
    """A vehicle in the plane whose speed and turn rate follow the commands with a lag."""

    lag = Param(0.5, unit="s", gt=0.0, doc="Time constant of speed and turn rate.")
    top_speed = Param(30.0, unit="m/s", gt=0.0, doc="Largest speed.")
    x = State("east north yaw v w", unit="m m rad m/s rad/s", doc="Position, heading, speed, turn rate.")
    speed = Input(unit="m/s", doc="Commanded speed.")
    turn_rate = Input(unit="rad/s", doc="Commanded turn rate, counter-clockwise.")

    @staticmethod
    def derivative(
        yaw: float, v: float, w: float, speed: float, turn_rate: float, lag: float, top_speed: float
    ) -> tuple[float, float, float, float, float]:
        """(east', north' [m/s], yaw' [rad/s], v' [m/s^2], w' [rad/s^2]); arguments are matched by name."""
        wanted = min(max(speed, -top_speed), top_speed)
        return v * cos(yaw), v * sin(yaw), w, (wanted - v) / lag, (turn_rate - w) / lag

    def from_body(self, body: MotionBody, rows: np.ndarray) -> None:
        """Set the state of robots that were spawned, or moved by another plugin."""
        self.x[:2, rows] = body.pos[:2, rows]
        self.x[2, rows] = body.yaw[rows]
        self.x[3, rows] = body.forward_speed[rows]
        self.x[4, rows] = 0.0

    def to_body(self, body: MotionBody) -> None:
        """Write the state to the body table, which other plugins read."""
        body.pos[:2] = self.x[:2]
        body.set_attitude(yaw=self.x[2])
        body.vel[:] = self.x[3] * body.forward
        body.omega[2] = self.x[4]
