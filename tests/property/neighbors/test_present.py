"""Neighbour queries return the present: every column of every neighbour, whoever asks and whoever has changed it.

Each check plays a game in which everything changes in each step, and compares with the body table itself.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import pytest

from tussle import Block, Mission, Simulation
from tussle.api import (
    Autonomy,
    Controller,
    Input,
    Interaction,
    Metric,
    Output,
    Param,
    Sensor,
    State,
    bodies,
    neighbors,
)
from tussle.stock import Unicycle

COLUMNS = (
    "id", "team", "health", "radius", "mass", "pos_x", "pos_y", "pos_z", "vel_x", "vel_y", "vel_z", "quat_w", "quat_x", "quat_y", "quat_z",
    "omega_x", "omega_y", "omega_z", "force_x", "force_y", "force_z", "torque_x", "yaw", "climb", "roll", "forward_x", "forward_y",
    "forward_z", "level_forward_x", "level_forward_y",
)  # fmt: skip
STEPS = 45
SIGHTS = 12.0 * 1.13 ** (np.arange(STEPS + 1) - 20.0)
"""Radius of each step [m], from nobody in range to everybody."""


def everything(
    other_id: int, other_team: int, other_health: float, other_radius: float, other_mass: float,
    other_pos_x: float, other_pos_y: float, other_pos_z: float, other_vel_x: float, other_vel_y: float, other_vel_z: float,
    other_quat_w: float, other_quat_x: float, other_quat_y: float, other_quat_z: float,
    other_omega_x: float, other_omega_y: float, other_omega_z: float, other_force_x: float, other_force_y: float, other_force_z: float,
    other_torque_x: float, other_yaw: float, other_climb: float, other_roll: float,
    other_forward_x: float, other_forward_y: float, other_forward_z: float, other_level_forward_x: float, other_level_forward_y: float,
):  # fmt: skip
    return (
        other_id, other_team, other_health, other_radius, other_mass, other_pos_x, other_pos_y, other_pos_z, other_vel_x, other_vel_y,
        other_vel_z, other_quat_w, other_quat_x, other_quat_y, other_quat_z, other_omega_x, other_omega_y, other_omega_z, other_force_x,
        other_force_y, other_force_z, other_torque_x, other_yaw, other_climb, other_roll, other_forward_x, other_forward_y,
        other_forward_z, other_level_forward_x, other_level_forward_y,
    )  # fmt: skip


def column(table, name: str) -> np.ndarray:
    """A column of the body table by the name that laws give it."""
    head, _, axis = name.rpartition("_")
    if axis not in ("w", "x", "y", "z"):
        return getattr(table, name)
    return getattr(table, head)["wxyz".index(axis) if head == "quat" else "xyz".index(axis)]


class Asks:
    """Asks in each step, and compares with the table. `at_start`: (world, id) -> position at the start of the step, where these decide."""

    checked: ClassVar[dict[str, int]] = {}
    at_start: ClassVar[dict[tuple[int, int], np.ndarray]] = {}

    seen = neighbors("sight", **dict.fromkeys(COLUMNS, "each"))(everything)
    constant = neighbors("fixed", **dict.fromkeys(COLUMNS, "each"))(everything)

    def ask(self, g, steps: np.ndarray, in_turn: bool) -> None:
        table, rows = g.bodies, np.arange(g.first, g.last)
        decides = table.pos
        if in_turn and Asks.at_start:
            decides = np.array([Asks.at_start[key] for key in zip(table.world, table.id, strict=True)]).T
        offset = decides[:, None, :] - g.pos[:, :, None]
        square = offset[0] ** 2 + offset[1] ** 2 + offset[2] ** 2
        others = (table.world == g.world[:, None]) & (rows[:, None] != np.arange(table.n))
        for law, radius in ((self.seen, SIGHTS[steps]), (self.constant, np.full(g.n, 15.0))):
            expected = others & (square < (radius * radius)[:, None])
            found = law(g)
            assert np.array_equal(mask_of(found.row, found.other, expected.shape), expected)
            for name in COLUMNS:
                assert np.array_equal(getattr(found, name), column(table, name)[found.other]), name
            near = g.near(radius)
            assert np.array_equal(mask_of(near.row, near.other, expected.shape), expected)
            assert np.array_equal(near.health, table.health[near.other])
            assert np.array_equal(near.offset, table.pos[:, near.other] - g.pos[:, near.row])
            Asks.checked[type(self).__name__] = Asks.checked.get(type(self).__name__, 0) + expected.sum()


def mask_of(row: np.ndarray, other: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """Pairs as a mask; each occurs once."""
    mask = np.zeros(shape, bool)
    mask[row, other] = True
    assert mask.sum() == len(row)
    return mask


class EntityAsks(Asks):
    fixed = Param(15.0, unit="m")
    sight = State(unit="m")

    def step(self, g):
        self.sight[:] = SIGHTS[g.step_count]
        self.ask(g, g.step_count, self.in_turn)


class Pilot(EntityAsks, Autonomy):
    in_turn: ClassVar[bool] = True
    desired_speed = Output(unit="m/s")

    def step(self, g):
        super().step(g)
        self.desired_speed[:] = 3.0 + g.id % 4


class Hand(EntityAsks, Controller):
    in_turn: ClassVar[bool] = True
    desired_speed = Input(unit="m/s")
    speed = Output(unit="m/s")
    turn_rate = Output(unit="rad/s")
    pitch_rate = Output(unit="rad/s")

    def step(self, g):
        super().step(g)
        self.speed[:] = self.desired_speed
        self.turn_rate[:] = np.where(g.id % 2, 0.4, -0.4)
        self.pitch_rate[:] = 0.1


class Eye(EntityAsks, Sensor):
    in_turn: ClassVar[bool] = False


class WorldAsks(Asks):
    fixed = Param(15.0, unit="m")
    sight = State(per="world", unit="m")

    def step(self, w):
        self.sight[:] = SIGHTS[w.step_count]
        self.ask(w, w.step_count[w.world], False)


class Referee(WorldAsks, Interaction):
    """Asks, changes all that it may, and asks again."""

    def step(self, w):
        super().step(w)
        w.bodies.health[:] -= 0.25 * w.id
        w.bodies.force[0] += 2.0 * w.id
        w.bodies.torque[0] -= 1.0
        super().step(w)
        w.move(w.id % 3 == 0, pos=w.pos[:, w.id % 3 == 0] + 1.5, omega=np.array([0.1, 0.2, 0.3]))
        super().step(w)


class Second(WorldAsks, Interaction):
    pass


class Gauge(WorldAsks, Metric):
    pass


KINDS = ("Pilot", "Hand", "Eye", "Referee", "Second", "Gauge")


@pytest.mark.parametrize(
    "room", [(bodies.KEPT_INDEXES, bodies.KEPT_RANGES), (1, 0)], ids=["as shipped", "least room"]
)
@pytest.mark.parametrize("update", ["synchronous", "sequential"])
def test_neighbours_are_seen_as_they_are(update, room, monkeypatch):
    monkeypatch.setattr(bodies, "KEPT_INDEXES", room[0])
    monkeypatch.setattr(bodies, "KEPT_RANGES", room[1])
    monkeypatch.setattr(Asks, "checked", {})
    monkeypatch.setattr(Asks, "at_start", {})
    crowd = lambda name, team, rate=None, **more: Block(  # noqa: E731
        name=name, team=team, variance=(150.0, 150.0, 20.0), heading_variance=3.0, health=1e6, mass=2.0, autonomy=Pilot(rate=rate),
        controller=Hand(), motion=Unicycle(vel_max=9.0), sensor=Eye(), **more,
    )  # fmt: skip
    late = crowd("late", 2, rate=4.0, count=3, first_birth=0.5)
    mission = Mission(
        blocks=[crowd("first", 1, count=5), late], interactions=[Referee(), Second()], metrics=[Gauge()], update=update, end=STEPS * 0.1,
    )  # fmt: skip

    def keep(sim: Simulation) -> None:
        table = sim.state.population.bodies
        if update == "sequential":
            Asks.at_start = dict(
                zip(
                    zip(table.world.tolist(), table.id.tolist(), strict=True), table.pos.T.copy(), strict=True
                )
            )

    with Simulation(mission, seeds=[1, 2], on_error="raise") as sim:
        sim.observers.append(keep)
        sim.step(7)
        sim.reset([1])  # clocks differ from now on: plugins with a rate are called for some worlds only
        while not sim.is_over:
            sim.step()
    assert sorted(Asks.checked) == sorted(KINDS)
    assert min(Asks.checked.values()) > 500
