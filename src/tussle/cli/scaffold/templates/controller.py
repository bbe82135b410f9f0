"""A controller: converts desired values of an autonomy to inputs of the motion model, for all robots at once."""

import numpy as np

from tussle.api import Controller, GroupView, Input, Output, Param
from tussle.numeric import atan2, wrap


class New(Controller):
    """Turns to a heading and climbs to an altitude, each at a rate proportional to the error."""

    grade = "portable"

    turn_gain = Param(1.0, unit="1/s", ge=0.0, doc="Turn rate per heading error.")
    climb_gain = Param(1.0, unit="1/s", ge=0.0, doc="Pitch rate per error of the climb angle.")
    look_ahead = Param(100.0, unit="m", gt=0.0, doc="Distance over which an altitude error is corrected.")
    desired_heading = Input(unit="rad")
    desired_altitude = Input(unit="m")
    desired_speed = Input(unit="m/s")
    speed = Output(unit="m/s")
    turn_rate = Output(unit="rad/s")
    pitch_rate = Output(unit="rad/s")

    def step(self, g: GroupView) -> None:
        """Control all robots; every array has one value per robot."""
        climb = atan2(self.desired_altitude - g.pos[2], np.asarray(self.look_ahead))
        self.speed[:] = self.desired_speed
        self.turn_rate[:] = self.turn_gain * wrap(self.desired_heading - g.yaw)
        self.pitch_rate[:] = self.climb_gain * (climb - g.climb)
