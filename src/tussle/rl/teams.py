"""Tasks of team against team: interception, capture the flag, battle."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from tussle.api import Interaction, Param, neighbors
from tussle.mission import Block, Mission
from tussle.plugins.stock import (
    Boundary,
    BoundaryDefense,
    CaptureInBoundaryInteraction,
    FlagCaptureInteraction,
    Predator,
    SingleIntegrator,
    TakeFlag,
    Unicycle,
)  # fmt: skip
from tussle.rl.action import Act
from tussle.rl.observation import NearestOthers, Own
from tussle.rl.reward import Situation, Term, captured, captures, closing, died
from tussle.rl.task import Task

FLAG_RADIUS = 10.0
"""Distance from the flag at which it is taken [m]."""
HOME, FLAG, CAMP = 1, 2, 3
"""Ids of the boundaries of `Intercept`."""


def raid() -> Mission:
    """Five defenders around a flag, and five raiders that come for it from the east."""
    defenders = Block(
        name="defenders", team=1, count=5, placement="uniform", half_width=(50.0, 50.0, 0.0), scatter_first=True,
        autonomy=BoundaryDefense(boundary_id=HOME), motion=SingleIntegrator(max_speed=15.0),
    )  # fmt: skip
    raiders = Block(
        name="raiders", team=2, count=5, position=(280.0, 0.0, 0.0), placement="uniform", half_width=(40.0, 150.0, 0.0), scatter_first=True,
        autonomy=TakeFlag(flag_boundary_id=FLAG, capture_boundary_id=CAMP), motion=SingleIntegrator(max_speed=12.0),
    )  # fmt: skip
    places = (
        ("home", HOME, 1, 0.0, 200.0),
        ("flag", FLAG, 1, 0.0, FLAG_RADIUS),
        ("camp", CAMP, 2, 400.0, 50.0),
    )
    boundaries = [
        Boundary(name=name, boundary_id=i, team=team, shape="sphere", center=(east, 0.0, 0.0), radius=radius)
        for name, i, team, east, radius in places
    ]
    rules = [
        CaptureInBoundaryInteraction(boundary_id=HOME, capture_range=5.0, cool_down_period=5.0),
        FlagCaptureInteraction(flag_boundary_id=FLAG, capture_boundary_id=CAMP),
    ]
    return Mission(
        blocks=[defenders, raiders], dt=0.1, end=60.0, interactions=[*boundaries, *rules], name="raid",
        end_conditions="time, one_team, all_dead",
    )  # fmt: skip


def are_at_flag(now: Situation) -> np.ndarray:
    """Worlds in which a raider has reached the flag, (W, 1)."""
    pos, is_alive = now.simulation.read("raiders.pos")
    return np.asarray((is_alive & (np.linalg.norm(pos, axis=-1) <= FLAG_RADIUS)).any(axis=1)[:, None])


def closing_in(now: Situation) -> np.ndarray:
    """Speed at which the distance to the nearest raider decreases [m/s], (W, A); 0 without raiders."""
    return closing(now, "raiders")


class Intercept(Task):
    """Five defenders catch five raiders before one of them takes the flag; who caught one cannot catch for 5 s."""

    mission = raid()
    learners = "defenders"
    observation = (
        Own("pos", scale=100.0, planar=True),
        NearestOthers(5, of="other", planar=True, scale={"offset": 100.0, "relative_vel": 15.0}),
        NearestOthers(4, of="own", planar=True, scale={"offset": 100.0, "relative_vel": 15.0}),
    )
    action = (Act("velocity_x", -15.0, 15.0), Act("velocity_y", -15.0, 15.0), Act("velocity_z", value=0.0))
    reward = {  # noqa: RUF012
        "captures": Term(captures, 1.0), "flag": Term(are_at_flag, -1.0), "closing": Term(closing_in, 0.001),
    }  # fmt: skip
    decide_every = 5

    def ends(self, now: Situation) -> Any:
        return are_at_flag(now)[:, 0]


def flag_balance(now: Situation) -> np.ndarray:
    """1 where blue has captured the flag, -1 where red has, (W, 1)."""
    values, _ = now.simulation.read("FlagCaptureMetrics.flags_captured")
    return np.asarray(values[:, 0] - values[:, 1], float)[:, None]


class CaptureTheFlag(Task):
    """Three against three: the blue ones fetch the red flag, and keep the red ones, which play by rule, from theirs."""

    mission = "capture_the_flag"
    overrides = {  # noqa: RUF012
        "blue_defenders": 1, "blue_runners": 2, "red_defenders": 1, "red_runners": 2, "end": 150,
    }  # fmt: skip
    learners = "blue_defenders blue_runners"
    opponents, is_symmetric = "tussle/CaptureTheFlagRed-v0", True
    observation = (
        Own("pos", scale=300.0, origin=(0.0, 0.0, 100.0)),
        NearestOthers(5, scale={"offset": 300.0, "relative_vel": 10.0}),
    )
    action = (
        Act("velocity_x", -10.0, 10.0),
        Act("velocity_y", -10.0, 10.0),
        Act("velocity_z", -10.0, 10.0),
    )
    reward = {  # noqa: RUF012
        "flag": Term(flag_balance), "captures": Term(captures, 0.3), "captured": Term(captured, -0.3),
    }  # fmt: skip
    decide_every = 5

    def ends(self, now: Situation) -> Any:
        return flag_balance(now)[:, 0] != 0.0


class CaptureTheFlagRed(CaptureTheFlag):
    """The red ones of `CaptureTheFlag`, which see and fly the field reflected in its centre, so that the blue ones' policy fits."""

    learners = "red_defenders red_runners"
    opponents = "tussle/CaptureTheFlag-v0"
    observation = (
        Own("pos", scale=-300.0, origin=(0.0, 0.0, 100.0)),
        NearestOthers(5, scale={"offset": -300.0, "relative_vel": -10.0}),
    )
    action = (Act("velocity_x", 10.0, -10.0), Act("velocity_y", 10.0, -10.0), Act("velocity_z", 10.0, -10.0))
    reward = {**CaptureTheFlag.reward, "flag": Term(flag_balance, -1.0)}  # noqa: RUF012


class Fire(Interaction):
    """Every entity damages all enemies within reach."""

    grade = "portable"

    reach = Param(6.0, unit="m", gt=0.0, doc="Distance below which enemies are hit.")
    damage = Param(0.1, gt=0.0, doc="Health that each hit takes.")

    @neighbors("reach", n="count", teams="other")
    @staticmethod
    def hit(distance: float) -> bool:
        return distance >= 0.0

    def step(self, w: Any) -> None:
        w.bodies.health[:] -= self.damage[w.world] * self.hit(w).n


def armies(count: int) -> Mission:
    """Two armies that attack each other, by rule or as their learners say.

    Args:
        count: Number of entities in each.
    """
    half = 10.0 * (count / 10.0) ** 0.5
    blocks = [
        Block(
            name=name, team=team, count=count, position=(side * 1.2 * half, 0.0, 0.0), placement="uniform",
            half_width=(half, 2.0 * half, 0.0),
            scatter_first=True, heading=np.pi * (team - 1), autonomy=Predator(max_speed=10.0, prey_team_id=3 - team),
            motion=Unicycle(vel_max=10, turn_rate_max=2),
        )
        for name, team, side in (("red", 1, -1.0), ("blue", 2, 1.0))
    ]  # fmt: skip
    return Mission(
        blocks=blocks, dt=0.1, end=30.0, interactions=[Fire()], name="battle", end_conditions="time, one_team, all_dead"
    )  # fmt: skip


def balance(now: Situation) -> np.ndarray:
    """Share of the red army that is alive less that of the blue one, (W, 1)."""
    counts = {b.name: b.count for b in now.simulation.mission.blocks}
    red, blue = (now.n_living(name) / counts[name] for name in ("red", "blue"))
    return np.asarray(red - blue)[:, None]


def hits(now: Situation, enemy: str) -> np.ndarray:
    """Enemies within reach, which the agent hits and which hit it, (W, A)."""
    reach: Any = Fire.reach.default
    return now.n_within(reach, enemy)


class Battle(Task):
    """100 against 100: the red army learns, the blue one attacks by rule. Each damages all enemies within 6 m."""

    mission = armies(100)
    learners = "red"
    opponents, is_symmetric = "tussle/BattleBlue-v0", True
    margin = "alive[1]-alive[2]"
    observation = (
        Own("vel", scale=10.0, planar=True, frame="heading"),
        Own("health"),
        NearestOthers(8, radius=60.0, planar=True, columns="offset same_team present", scale={"offset": 60.0}, frame="heading"),
    )  # fmt: skip
    action = (Act("turn_rate", -2.0, 2.0), Act("speed", 0.0, 10.0), Act("pitch_rate", value=0.0))
    reward = {  # noqa: RUF012
        "balance": Term(balance, 0.05), "hits": Term(partial(hits, enemy="blue"), 0.01), "died": Term(died, -0.1),
    }  # fmt: skip


class BattleBlue(Battle):
    """The blue army of `Battle` learns, the red one attacks by rule."""

    learners = "blue"
    opponents = "tussle/Battle-v0"
    margin = "alive[2]-alive[1]"
    reward = {  # noqa: RUF012
        **Battle.reward, "balance": Term(balance, -0.05), "hits": Term(partial(hits, enemy="red"), 0.01),
    }  # fmt: skip


__all__ = ["Battle", "BattleBlue", "CaptureTheFlag", "CaptureTheFlagRed", "Intercept"]
