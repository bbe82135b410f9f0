"""Pieces for tests of vehicles with six degrees of freedom."""

from __future__ import annotations

import numpy as np

from tussle import Block, Mission, Simulation
from tussle.api import Autonomy, Output, Param
from tussle.numeric.quaternion import quat_from_euler

LOADS = np.zeros(6)
"""No external force and torque."""


class Pilot(Autonomy):
    """Wants constant values."""

    heading = Param(0.0)
    altitude = Param(0.0)
    speed = Param(0.0)
    vel = Param((0.0, 0.0, 0.0), fields="x y z")
    desired_heading = Output(unit="rad")
    desired_altitude = Output(unit="m")
    desired_speed = Output(unit="m/s")
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    def step(self, g):
        self.desired_heading[:], self.desired_altitude[:] = self.heading, self.altitude
        self.desired_speed[:], self.velocity[:] = self.speed, self.vel


def state(pos=(0.0, 0.0, 0.0), vel=(0.0, 0.0, 0.0), omega=(0.0, 0.0, 0.0), roll=0.0, climb=0.0, yaw=0.0):
    """State of a rigid body, (13,)."""
    return np.concatenate([pos, vel, quat_from_euler(roll, -climb, yaw), omega])


def inputs(steps, *commands, loads=LOADS, mass=()):
    """The same commands in every step, for `rollout`."""
    return np.tile(np.concatenate([commands, loads, mass]), (steps, 1))


def flight(motion, controllers, pilot, dt, seconds, later=0.0, **block):
    """A simulation after a flight, which may go on for `later` seconds."""
    entity = Block(name="a", autonomy=pilot, controller=controllers, motion=motion, **block)
    sim = Simulation(Mission(blocks=[entity], dt=dt, end=seconds + dt + later))
    sim.step(round(seconds / dt))
    return sim


def seen(sim, name):
    """A column of the only entity, (k,) or a number."""
    return sim.read(f"a.{name}")[0][0, 0]
