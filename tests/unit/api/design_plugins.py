"""The three plugins of the design page, as they stand there: easy mode, vector mode, a motion model."""

from __future__ import annotations

import math

import numpy as np

from tussle.api import (
    Autonomy,
    EasyAutonomy,
    EntityRef,
    Input,
    MotionModel,
    Output,
    Param,
    Publish,
    State,
    unit,
    wrap,
)
from tussle.messages import CaptureEntity
from tussle.numeric import cos, sin, tan


class Chaser(EasyAutonomy):
    """Chase the nearest prey and keep to it until it is gone."""

    prey_team = Param(1, doc="Team that is hunted.")
    max_speed = Param(35.0, unit="m/s", ge=0.0)
    capture_range = Param(5.0, unit="m", gt=0.0)
    target = EntityRef(doc="Prey being chased; None when it is gone.")
    speed = Output(unit="m/s")
    turn_rate = Output(unit="rad/s")
    pitch_rate = Output(unit="rad/s")
    capture = Publish(CaptureEntity)

    def step_one(self, me):
        me.target = me.target or me.nearest(team=me.prey_team)
        if me.target is None:
            me.speed = me.turn_rate = me.pitch_rate = 0.0
            return
        east, north, up = me.target.pos - me.pos
        me.speed = me.max_speed
        me.turn_rate = wrap(math.atan2(north, east) - me.yaw)
        me.pitch_rate = math.atan2(up, math.hypot(east, north)) - me.climb
        if me.distance(me.target) < me.capture_range:
            me.publish("capture", target=me.target)


class Flock(Autonomy):
    """Separation, alignment and cohesion."""

    sight = Param(200.0, unit="m", gt=0.0)
    space = Param(20.0, unit="m", gt=0.0, doc="Distance below which team mates repel.")
    max_speed = Param(15.0, unit="m/s", ge=0.0)
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    def step(self, g):
        near = g.near(self.sight, teams="own")
        push = np.maximum(0.0, 1.0 - near.distance / self.space[near.row]) / near.distance
        v = (
            2.0 * near.sum(-push * near.offset)
            + 0.5 * unit(near.mean(near.vel))
            + unit(near.mean(near.offset))
        )
        self.velocity[:] = self.max_speed * unit(v)


class LaggedCar(MotionModel):
    """A car whose speed follows the command with a first-order lag."""

    lag = Param(0.5, unit="s", gt=0.0)
    wheelbase = Param(2.6, unit="m", gt=0.0)
    x = State("east north yaw v", unit="m m rad m/s")
    speed = Input(unit="m/s")
    steering = Input(unit="rad")

    @staticmethod
    def derivative(yaw, v, speed, steering, lag, wheelbase):
        return v * cos(yaw), v * sin(yaw), v * tan(steering) / wheelbase, (speed - v) / lag

    def from_body(self, body, rows):
        self.x[:2, rows] = body.pos[:2, rows]
        self.x[2, rows] = body.yaw[rows]
        self.x[3, rows] = body.forward_speed[rows]

    def to_body(self, body):
        east, north, yaw, v = self.x
        body.pos[0], body.pos[1] = east, north
        body.set_attitude(yaw=yaw)
        body.vel[0], body.vel[1], body.vel[2] = v * cos(yaw), v * sin(yaw), 0.0
