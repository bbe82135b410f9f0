"""Plugins that look at others in every way there is, with radii that change from step to step, and that do nothing."""

from __future__ import annotations

import dataclasses

import numpy as np

from tussle import Block, Mission
from tussle.api import Autonomy, EasyAutonomy, Metric, Param, Sensor, State, neighbors
from tussle.stock import Boids, BulletCollision, NoisyContacts, SimpleCollision, Unicycle

GROWTH = 1.06
"""Factor of a radius from step to step: in 220 steps it passes 18 octaves, more sizes than any cache of indexes keeps."""
LEAST = 0.02  # [m]


def radius_at(step: np.ndarray | int) -> np.ndarray:
    """Radius of a step [m]; it grows from below the distances of neighbours to beyond those of all."""
    return LEAST * GROWTH ** np.asarray(step, float)


def look(g) -> None:
    """Query neighbours of all rows of a view."""
    radius = radius_at(g.step_count) if len(g.step_count) == g.n else radius_at(g.step_count)[g.world]
    near = g.near(radius)
    near.sum(near.vel)
    g.near(float(radius.max(initial=1.0)) + 0.1, teams="own")
    g.nearest(2)
    for column in ("health", "vel", "team", "yaw", "level_forward"):
        g.by_place(g.index(radius), column)


class Autonomous(Autonomy):
    """Looks by a neighbour law with a radius of its own, and by queries."""

    looks = Param(True, doc="Whether it looks.")
    sight = State(unit="m")

    @neighbors("sight", n="count", east="sum", health="min")
    @staticmethod
    def seen(other_vel_x: float, other_health: float):
        return True, other_vel_x, other_health

    def step(self, g):
        if self.looks.all():
            self.sight[:] = radius_at(g.step_count)
            self.seen(g)
            look(g)
        self.sight[:] = 0.0  # the same state whether it looks or not


class Easy(EasyAutonomy):
    """Looks one entity at a time."""

    looks = Param(True, doc="Whether it looks.")

    def step_one(self, me):
        if me.looks and me.id % 5 == 0:
            radius = float(radius_at(round(me.t / me.dt)))
            sum(other.health for other in me.near(radius))
            me.nearest()


class Sensing(Sensor):
    """Looks after the motion."""

    looks = Param(True, doc="Whether it looks.")

    def step(self, g):
        if self.looks.all():
            look(g)


class Measuring(Metric):
    """Looks at all entities of all worlds, also by a law that lists pairs."""

    looks = Param(True, structural=True, doc="Whether it looks.")
    sight = State(per="world", unit="m")

    @neighbors("sight", other="each")
    @staticmethod
    def pairs(other_id: int):
        return other_id

    def step(self, w):
        if self.looks:
            self.sight[:] = radius_at(w.step_count)
            self.pairs(w)
            look(w)
        self.sight[:] = 0.0


def watched(mission: Mission, looks: bool) -> Mission:
    """The mission with an onlooker of each kind in each block and one beside; they look, or not."""
    blocks = [
        dataclasses.replace(
            block,
            autonomy=(Autonomous(looks=looks), *block.autonomy, Easy(looks=looks)),
            sensor=(*block.sensor, Sensing(looks=looks)),
        )
        for block in mission.blocks
    ]
    return mission.replace(blocks=blocks, metrics=[*mission.metrics, Measuring(looks=looks)])


def pushed_flocks(update: str, count: int) -> Mission:
    """Two flocks of bodies that bounce, whose search radius follows their motion, and that measure each other."""
    flock = lambda name, team, east, heading: Block(  # noqa: E731
        name=name, team=team, count=count, position=(east, 0.0, 100.0), variance=(200.0, 200.0, 20.0), heading=heading, radius=0.5,
        autonomy=Boids(comms_range=30.0), motion=Unicycle(use_pitch=True),
        sensor=NoisyContacts(max_range=25.0),
    )  # fmt: skip
    return Mission(
        blocks=[flock("west", 1, 0.0, 0.0), flock("east", 2, 60.0, "180 deg")],
        interactions=[BulletCollision(), SimpleCollision(collision_range=2.0)],
        update=update,
        end=30.0,
    )
