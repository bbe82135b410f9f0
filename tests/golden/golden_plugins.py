"""Plugins that the golden missions need and that do not ship: a talker, a nursery, a car on the shared integrator."""

from __future__ import annotations

import numpy as np

from tussle.api import Autonomy, Input, Interaction, MotionModel, Output, Param, Publish, State, Subscribe
from tussle.messages import Waypoint
from tussle.numeric import cos, sin, tan

VELOCITY = "velocity_x velocity_y velocity_z"


class Beacon(Autonomy):
    """Drift with a drawn velocity; every third step tell whoever hears it where it is, on average of what was heard."""

    grade = "portable"
    spread = Param(4.0, unit="m/s", ge=0.0)
    network = Param("SphereNetwork")
    n_heard = State(dtype=int)
    rumour = State("x y z", unit="m")
    said = Publish(Waypoint, network_param="network")
    heard = Subscribe(Waypoint, network_param="network")
    velocity = Output(VELOCITY, unit="m/s")

    def step(self, g):
        rows, notes = self.heard.pairs()
        np.add.at(self.n_heard, rows, 1)
        for row, pos in zip(rows, notes.pos.T, strict=True):
            self.rumour[:, row] = 0.5 * (self.rumour[:, row] + pos)
        self.velocity[:] = self.spread * g.normal("drift", 3)
        speaking = (g.step_count + g.id) % 3 == 0
        self.said.publish(speaking, pos=g.pos[:, speaking])


class Nursery(Interaction):
    """Every fourth step of a world ask for a new entity of a block, at a drawn place."""

    grade = "portable"
    block = Param("late")
    born = State(dtype=int, per="world")
    luck = State(per="world")

    def step(self, w):
        self.luck[:] = w.uniform("luck")
        due = np.flatnonzero((w.step_count % 4 == 3) & (np.bincount(w.world, minlength=w.n_worlds) > 0))
        self.born[due] += 1
        places = 80.0 * w.normal("place", 3)[:, due]
        w.spawn(self.block, due, pos=places)


class Car(MotionModel):
    """A car whose speed follows the command with a first-order lag; integrated by the shared driver."""

    grade = "portable"
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


class Wanderer(Autonomy):
    """Steer by a walk at random, away from the two nearest and from the mean of those within sight."""

    grade = "portable"
    sight = Param(60.0, unit="m", gt=0.0)
    wish = State(unit="rad")
    speed = Output(unit="m/s")
    steering = Output(unit="rad")

    def step(self, g):
        near = g.near(self.sight)
        self.wish[:] = 0.8 * self.wish + 0.1 * g.normal("wish")
        left = -g.forward[1] * near.mean(near.offset[0]) + g.forward[0] * near.mean(near.offset[1])
        nearest = np.minimum(g.nearest(2).distance, 50.0)
        self.steering[:] = np.clip(self.wish - 0.02 * left, -0.6, 0.6)
        self.speed[:] = 5.0 + 0.1 * (nearest[0] + nearest[1])
