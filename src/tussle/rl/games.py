"""Tasks that come with tussle."""

from __future__ import annotations

from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from tussle.engine.simulation import Simulation
from tussle.mission import Block, Mission
from tussle.plugins.stock import MotorSchemas, MoveToGoalMS, Predator, SingleIntegrator
from tussle.rl.action import Act
from tussle.rl.computed import Computed
from tussle.rl.observation import NearestOthers, Own
from tussle.rl.reward import Situation, Term, alive, captured, captures, closing
from tussle.rl.task import Task

RADIUS = 2.0
"""Distance along x below which robots are near [m]."""


class PredatorPrey(Task):
    """The paper's game for the prey: 100 learners flee from ten predators (DeMarco, Squires, Day and Pippin 2018)."""

    mission = "predator_prey"
    learners = "prey"
    observation = (
        Own("pos", scale=1000.0, origin=(0.0, 0.0, 200.0), frame="heading"),
        Own("vel forward", scale={"vel": 30.0}, frame="heading"),
        NearestOthers(8, scale={"offset": 200.0, "relative_vel": 30.0}),
    )
    action = (
        Act("speed", 0.0, 30.0),
        Act("turn_rate", -1.0, 1.0),
        Act("pitch_rate", -1.0, 1.0),
    )
    reward = {"alive": Term(alive, 0.01), "captured": Term(captured, -1.0)}  # noqa: RUF012 - declared as ClassVar in Task


def closing_speed(now: Situation) -> np.ndarray:
    """Speed at which the distance to the nearest prey decreases [m/s], (W, A); 0 without prey."""
    return closing(now, "prey")


def opening_speed(now: Situation) -> np.ndarray:
    """Speed at which the distance to the nearest predator increases [m/s], (W, A); 0 without predators."""
    return -closing(now, "keepers switchers")


class PreyEscape(Task):
    """The paper's game for the prey, in a form that is learned in minutes: each decides every 0.5 s by the five nearest predators."""

    mission = "predator_prey"
    learners = "prey"
    decide_every = 5
    observation = (
        Own("vel forward", scale={"vel": 30.0}, frame="heading"),
        NearestOthers(
            5,
            "direction distance relative_vel present",
            of="other",
            scale={"distance": 1000.0, "relative_vel": 30.0},
            frame="body",
        ),
    )
    action = (Act("speed", value=30.0), Act("turn_rate", -1.0, 1.0), Act("pitch_rate", -1.0, 1.0))
    reward = {"captured": Term(captured, -1.0), "opening": Term(opening_speed, 0.001)}  # noqa: RUF012 - declared as ClassVar in Task


class PredatorTeam(Task):
    """The paper's game for one team of five predators, against the other one, which pursues, and 100 prey, which flock.

    The learner flies; prey are claimed as by `Predator`.
    """

    mission = "predator_prey"
    learners = "switchers"
    decide_every = 2
    observation: ClassVar[Any] = (
        Own("vel", scale=35.0, frame="heading"),
        NearestOthers(
            3,
            "direction distance relative_vel present",
            of=1,
            scale={"distance": 300.0, "relative_vel": 35.0},
            frame="body",
        ),
        NearestOthers(1, "direction distance present", of="own", scale={"distance": 300.0}, frame="body"),
    )
    action: ClassVar[Any] = (
        Act("speed", value=35.0),
        Act("turn_rate", -2.0, 2.0),
        Act("pitch_rate", -1.5, 1.5),
        Act("Predator.capture_range", value=5.0),
    )
    reward = {"captures": Term(captures), "closing": Term(closing_speed, 0.0005)}  # noqa: RUF012 - declared as ClassVar in Task

    @cached_property
    def given(self) -> Mission:
        """The mission, in which the predators of the learner only claim."""
        mission = super().given
        claims = Predator(max_speed=35.0, capture_range=5.0, pursue=False)
        hunters = {
            name for name in self.learners.split() if name in ("keepers", "switchers") and self.acts(name)
        }
        return mission.replace(
            blocks=[b.replace(autonomy=claims) if b.name in hunters else b for b in mission.blocks]
        )


class PredatorsAndPrey(PredatorTeam):
    """The paper's game in which all learn: 100 prey, and two teams of five predators."""

    learners = "prey keepers switchers"
    observation = {  # noqa: RUF012
        "prey": PreyEscape.observation,
        "keepers": PredatorTeam.observation,
        "switchers": PredatorTeam.observation,
    }
    action = {  # noqa: RUF012
        "prey": PreyEscape.action,
        "keepers": PredatorTeam.action,
        "switchers": PredatorTeam.action,
    }
    policies = {"prey": "prey", "keepers": "keepers", "switchers": "switchers"}  # noqa: RUF012
    reward = {"captures": Term(captures), "captured": Term(captured, -1.0)}  # noqa: RUF012 - declared as ClassVar in Task


def robots(count: int, spread: float, **plugins: Any) -> Mission:
    """Robots that move on a line for 100 s.

    Args:
        count: How many.
        spread: Half of the range of their first x [m].
        plugins: Further plugins of the block.
    """
    block = Block(
        name="robot", count=count, placement="uniform", half_width=(spread, 0.0, 0.0), scatter_first=True, motion=SingleIntegrator(),
        **plugins,
    )  # fmt: skip
    return Mission(blocks=[block], end=100.0, dt=1.0, name="robots")


def to_origin() -> MotorSchemas:
    """The rule of both games: go to the origin at 1 m/s."""
    return MotorSchemas(max_speed=1.0, behaviors=[MoveToGoalMS()])


def x_and_time(simulation: Simulation) -> np.ndarray:
    """Position along x [m] and time [s] of each robot, (W, A, 2)."""
    x = simulation.read("robot.pos")[0][..., 0]
    return np.stack([x, np.broadcast_to(simulation.t[:, None], x.shape)], axis=-1)


def all_x(simulation: Simulation) -> np.ndarray:
    """Positions of all robots along x [m], the same for each, (W, A, A)."""
    x = simulation.read("robot.pos")[0][..., 0]
    return np.repeat(x[:, None], x.shape[1], axis=1)


def near_origin(now: Situation) -> np.ndarray:
    """1 for who is nearer to the origin than `RADIUS` along x, rounded to whole metres, (W, A)."""
    return np.where(np.floor(np.abs(now.pos[..., 0]) + 0.5) < RADIUS, 1.0, 0.0)


def near_others(now: Situation) -> np.ndarray:
    """Share of all robots that are others nearer than `RADIUS` along x, (W, A)."""
    x = now.pos[..., 0]
    near = np.abs(x[:, :, None] - x[:, None]) < RADIUS
    return np.asarray((near.sum(axis=-1) - 1) / x.shape[-1])


class NearOrigin(Task):
    """SCRIMMAGE's game RLSimple: a robot goes 1 m/s to the left or right, and is rewarded for each second near the origin."""

    mission = robots(1, 10.0)
    scripted = robots(1, 10.0, autonomy=to_origin())
    learners = "robot"
    observation = (Computed(2, x_and_time),)
    action = (Act("velocity_x", levels=[-1.0, 1.0]),)
    reward = {"near": Term(near_origin)}  # noqa: RUF012 - declared as ClassVar in Task


class Consensus(Task):
    """SCRIMMAGE's game RLConsensus: ten robots go 1 m/s to the left or right, and are rewarded for being near each other."""

    mission = robots(10, 50.0)
    scripted = robots(10, 50.0, autonomy=to_origin())
    learners = "robot"
    observation = (Computed(10, all_x),)
    action = (Act("velocity_x", levels=[-1.0, 1.0]),)
    reward = {"near": Term(near_others)}  # noqa: RUF012 - declared as ClassVar in Task


__all__ = ["Consensus", "NearOrigin", "PredatorPrey", "PredatorTeam", "PredatorsAndPrey", "PreyEscape"]
