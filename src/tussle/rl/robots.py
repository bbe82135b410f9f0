"""Tasks of robots: way-finding, hovering, flocking, coverage."""

from __future__ import annotations

from typing import Any

import numpy as np

from tussle.mission import Block, Mission
from tussle.plugins.stock import (
    AvoidEntityMS,
    Boids,
    GoTo,
    MotorSchemas,
    MoveToGoalMS,
    SimpleCollision,
    SimpleQuadrotor,
    SimpleQuadrotorControllerLQR,
    SingleIntegrator,
    Still,
    Unicycle,
    UnicyclePID,
)  # fmt: skip
from tussle.rl.action import Act
from tussle.rl.observation import NearestOthers, Own, Sectors
from tussle.rl.reward import Situation, Term, died, dot
from tussle.rl.task import Task

GOAL = (100.0, 0.0, 0.0)
"""Goal of `FindWay` [m]."""
HOVER = (0.0, 0.0, 10.0)
"""Place of `Hover` [m]."""
SPACING = (5.0, 20.0)
"""Distances of the nearest other in a flock that are neither too small nor too large [m]."""
SENSED, HEARD, FIELD = 25.0, 60.0, 100.0
"""Of coverage: reach of a robot's sensor, reach of its radio, and half of the field's edge [m]."""


def single(name: str, end: float, **plugins: Any) -> Mission:
    """One robot that starts anywhere within 100 m of the origin, above the ground if it flies."""
    half_height = 8.0 if isinstance(plugins["motion"], SimpleQuadrotor) else 0.0
    robot = Block(
        name="robot", position=(0.0, 0.0, 10.0 if half_height else 0.0), placement="uniform", scatter_first=True,
        half_width=(50.0, 50.0, half_height), **plugins,
    )  # fmt: skip
    return Mission(blocks=[robot], dt=0.1, end=end, name=name)


def nearness(now: Situation) -> np.ndarray:
    """1 at the origin, 0 at 100 m and beyond, (W, A)."""
    return np.asarray(np.maximum(0.0, 1.0 - np.linalg.norm(now.pos, axis=-1) / 100.0))


class ReachPoint(Task):
    """A unicycle drives to the origin and stays there; it starts up to 70 m away."""

    mission = single("waypoint", 30.0, motion=Unicycle(vel_max=10, turn_rate_max=1))
    scripted = single(
        "waypoint", 30.0, motion=Unicycle(vel_max=10, turn_rate_max=1), controller=UnicyclePID(),
        autonomy=GoTo(waypoints=((0.0, 0.0, 0.0),), speed=10.0, tolerance=1.0),
    )  # fmt: skip
    learners = "robot"
    observation = (
        Own("pos", scale=50.0, planar=True, frame="heading"),
        Own("vel", scale=10.0, planar=True, frame="heading"),
    )
    action = (Act("speed", -10.0, 10.0), Act("turn_rate", -1.0, 1.0), Act("pitch_rate", value=0.0))
    reward = {"near": Term(nearness, 0.01)}  # noqa: RUF012 - declared as ClassVar in Task


def hovering(now: Situation) -> np.ndarray:
    """Nearness to the point 10 m above the origin: 1 there, 1/e at 10 m, (W, A)."""
    return np.asarray(np.exp(-np.linalg.norm(now.pos - HOVER, axis=-1) / 10.0))


def towards(now: Situation, goal: tuple[float, float, float]) -> np.ndarray:
    """Speed at which the distance to a point decreases [m/s], (W, A)."""
    offset = goal - now.pos
    return np.asarray(dot(offset, now.vel) / np.maximum(np.sqrt(dot(offset, offset)), 1e-9))


def approaching(now: Situation) -> np.ndarray:
    """Speed towards the point 10 m above the origin [m/s], (W, A)."""
    return towards(now, HOVER)


class Hover(Task):
    """A quadrotor flies to the point 10 m above the origin and hovers; accelerations are its actions."""

    mission = single("hover", 20.0, motion=SimpleQuadrotor())
    scripted = single(
        "hover", 20.0, motion=SimpleQuadrotor(), controller=SimpleQuadrotorControllerLQR(),
        autonomy=GoTo(waypoints=((0.0, 0.0, 10.0),), tolerance=0.5),
    )  # fmt: skip
    learners = "robot"
    observation = (
        Own("pos", scale=20.0, origin=(0.0, 0.0, 10.0), frame="heading"),
        Own("vel", scale=10.0, frame="heading"),
    )
    action = (
        Act("x_thrust", -5.0, 5.0),
        Act("y_thrust", -5.0, 5.0),
        Act("z_thrust", -5.0, 5.0),
        Act("turn_force", value=0.0),
    )
    reward = {"near": Term(hovering, 0.01), "approach": Term(approaching, 0.001)}  # noqa: RUF012


def way(**plugins: Any) -> Mission:
    """Eight robots in the west, their goal in the east, and 20 rocks between. Who touches another robot or a rock is out."""
    robots = Block(
        name="robot", count=8, position=(-100.0, 0.0, 0.0), placement="uniform", half_width=(10.0, 40.0, 0.0), scatter_first=True,
        motion=Unicycle(vel_max=10, turn_rate_max=2), **plugins,
    )  # fmt: skip
    rocks = Block(
        name="rock", team=2, count=20, placement="uniform", half_width=(60.0, 60.0, 0.0), scatter_first=True, motion=Still()
    )  # fmt: skip
    collision = SimpleCollision(collision_range=3.0, startup_collision_range=6.0)
    return Mission(blocks=[robots, rocks], dt=0.1, end=40.0, interactions=[collision], name="way")


def progress(now: Situation) -> np.ndarray:
    """Speed towards the goal [m/s]; 0 within 10 m of it, (W, A)."""
    return np.where(now.alive & (np.linalg.norm(GOAL - now.pos, axis=-1) > 10.0), towards(now, GOAL), 0.0)


def there(now: Situation) -> np.ndarray:
    """1 within 10 m of the goal, (W, A)."""
    return np.asarray(now.alive & (np.linalg.norm(GOAL - now.pos, axis=-1) <= 10.0))


class FindWay(Task):
    """Eight robots drive round rocks to their goal; each sees the nearest obstacle in 16 sectors around it."""

    mission = way()
    scripted = way(
        controller=UnicyclePID(),
        autonomy=MotorSchemas(
            max_speed=10.0, behaviors=[AvoidEntityMS(sphere_of_influence=10.0, minimum_range=3.2), MoveToGoalMS(goal=GOAL)]
        ),
    )  # fmt: skip
    learners = "robot"
    observation = (
        Own("pos", scale=100.0, origin=GOAL, planar=True, frame="heading"),
        Own("vel", scale=10.0, planar=True, frame="heading"),
        Sectors(16, radius=30.0),
    )
    action = (Act("speed", 0.0, 10.0), Act("turn_rate", -2.0, 2.0), Act("pitch_rate", value=0.0))
    reward = {"progress": Term(progress, 0.001), "there": Term(there, 0.01), "collided": Term(died, -1.0)}  # noqa: RUF012


def headings(now: Situation) -> np.ndarray:
    """Share of the flock's common heading in each own heading, -1 to 1, (W, A)."""
    unit = now.vel / np.maximum(np.sqrt(dot(now.vel, now.vel)), 1e-9)[..., None]
    mean = unit.sum(axis=1, keepdims=True) / np.maximum(now.alive.sum(axis=1), 1)[:, None, None]
    return dot(unit, mean)


def spacing(now: Situation) -> np.ndarray:
    """1 where the nearest other is neither too near nor too far, (W, A)."""
    distance = now.nearest().distance
    return np.asarray((distance > SPACING[0]) & (distance < SPACING[1]))


class Formation(Task):
    """Sixteen unicycles with different headings learn to fly in one direction and to keep their distance."""

    mission = Mission(
        blocks=[
            Block(
                name=f"robot_{k}", count=4, placement="uniform", half_width=(40.0, 40.0, 0.0), scatter_first=True,
                heading=0.5 * np.pi * k,
                autonomy=Boids(
                    max_speed=10.0, comms_range=60.0, sphere_of_influence=15.0, minimum_team_range=5.0, goal_weight=0.0
                ),
                motion=Unicycle(vel_max=10, turn_rate_max=1),
            )
            for k in range(4)
        ],
        dt=0.1, end=30.0, name="formation",
    )  # fmt: skip
    learners = "robot_0 robot_1 robot_2 robot_3"
    observation = (
        Own("vel", scale=10.0, planar=True, frame="heading"),
        NearestOthers(6, planar=True, scale={"offset": 40.0, "relative_vel": 10.0}),
    )
    action = (Act("speed", 0.0, 10.0), Act("turn_rate", -1.0, 1.0), Act("pitch_rate", value=0.0))
    reward = {"aligned": Term(headings, 0.01), "spaced": Term(spacing, 0.01)}  # noqa: RUF012


def linked(now: Situation) -> np.ndarray:
    """Robots whose radio reaches the base at the origin, directly or over others, (W, A)."""
    pos = now.pos[..., :2]
    offset = pos[:, :, None] - pos[:, None]
    hears = (offset * offset).sum(axis=-1) < HEARD * HEARD
    found = now.alive & ((pos * pos).sum(axis=-1) < HEARD * HEARD)
    while True:
        more = found | (now.alive & (hears & found[:, None, :]).any(axis=-1))
        if (more == found).all():
            return np.asarray(found)
        found = more


def seen(now: Situation) -> np.ndarray:
    """Places of the field, on a grid of 10 m, that each linked robot senses, (W, A, n)."""
    places = np.arange(-FIELD + 5.0, FIELD, 10.0)
    x, y = ((now.pos[..., k, None] - places) ** 2 for k in (0, 1))
    sees = (x[..., :, None] + y[..., None, :] < SENSED * SENSED) & linked(now)[..., None, None]
    return np.asarray(sees.reshape(*now.alive.shape, -1))


def covered(now: Situation) -> np.ndarray:
    """Share of the field within the sensors of linked robots, (W, 1)."""
    return np.asarray(seen(now).any(axis=1).mean(axis=-1)[:, None])


def covered_alone(now: Situation) -> np.ndarray:
    """Share of the field that only this robot sees: the difference reward of Wolpert and Tumer (2002), but for its links, (W, A)."""
    sees = seen(now)
    return np.asarray((sees & (sees.sum(axis=1, keepdims=True) == 1)).mean(axis=-1))


class Coverage(Task):
    """Twelve robots spread over a field to see as much of it as they can, without losing the radio link to their base."""

    mission = Mission(
        blocks=[
            Block(
                name="robot", count=12, placement="uniform", half_width=(20.0, 20.0, 0.0), scatter_first=True,
                motion=SingleIntegrator(),
                autonomy=MotorSchemas(
                    max_speed=5.0, behaviors=[AvoidEntityMS(sphere_of_influence=50.0, minimum_range=1.0), MoveToGoalMS(gain=0.1)]
                ),
            )
        ],
        dt=0.1, end=40.0, name="coverage",
    )  # fmt: skip
    learners = "robot"
    observation = (
        Own("pos", scale=FIELD, planar=True),
        NearestOthers(6, radius=HEARD, planar=True, columns="offset present", scale={"offset": HEARD}),
    )
    action = (Act("velocity_x", -5.0, 5.0), Act("velocity_y", -5.0, 5.0))
    reward = {"covered": Term(covered, 0.01), "alone": Term(covered_alone, 0.1)}  # noqa: RUF012
    decide_every = 5


__all__ = ["Coverage", "FindWay", "Formation", "Hover", "ReachPoint"]
