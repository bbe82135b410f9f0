"""A controller: converts desired values of an autonomy to inputs of the motion model, in plain Python for one robot at a time."""

import math

from tussle.api import EasyController, Input, Me, Output, Param, wrap


class New(EasyController):
    """Turns to a heading and climbs to an altitude, each at a rate proportional to the error."""

    turn_gain = Param(1.0, unit="1/s", ge=0.0, doc="Turn rate per heading error.")
    climb_gain = Param(1.0, unit="1/s", ge=0.0, doc="Pitch rate per error of the climb angle.")
    look_ahead = Param(100.0, unit="m", gt=0.0, doc="Distance over which an altitude error is corrected.")
    desired_heading = Input(unit="rad")
    desired_altitude = Input(unit="m")
    desired_speed = Input(unit="m/s")
    speed = Output(unit="m/s")
    turn_rate = Output(unit="rad/s")
    pitch_rate = Output(unit="rad/s")

    def step_one(self, me: Me) -> None:
        """Control one robot. `me` has its pos, yaw, climb, and the columns declared above."""
        climb = math.atan2(me.desired_altitude - me.pos[2], me.look_ahead)
        me.speed = me.desired_speed
        me.turn_rate = me.turn_gain * wrap(me.desired_heading - me.yaw)
        me.pitch_rate = me.climb_gain * (climb - me.climb)
