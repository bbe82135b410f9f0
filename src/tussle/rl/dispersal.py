"""A task of robots that enter one by one: agents are born, moves are masked, observations have named parts, the critic sees the room."""

from __future__ import annotations

from typing import Any

import numpy as np

from tussle.mission import Block, Mission
from tussle.plugins.stock import AvoidEntityMS, MotorSchemas, MoveToGoalMS, SingleIntegrator
from tussle.rl.action import Act
from tussle.rl.computed import Computed
from tussle.rl.observation import NearestOthers, Own
from tussle.rl.reward import Situation, Term
from tussle.rl.task import Task

SIDE = 6
"""Cells along a wall of the room, each 1 m wide; the door is the cell at the origin, in a corner."""
MOVES = np.array([(0, 0), (-1, 0), (1, 0), (0, -1), (0, 1)])
"""Moves of a robot in one decision [cells]."""


def room() -> Mission:
    """Twenty robots enter through the door, one every 2 s."""
    robots = Block(
        name="robot", count=20, position=(0.0, 0.0, 0.0), variance=(0.0, 0.0, 0.0), radius=0.4, rate=0.5,
        motion=SingleIntegrator(max_speed=1.0),
        autonomy=MotorSchemas(
            max_speed=1.0,
            behaviors=[
                AvoidEntityMS(sphere_of_influence=2.5, minimum_range=1.0),
                MoveToGoalMS(goal=(SIDE / 2, SIDE / 2, 0.0), gain=0.02),
            ],
        ),
    )  # fmt: skip
    return Mission(blocks=[robots], dt=0.1, end=60.0, name="dispersal")


def cells_of(pos: np.ndarray) -> np.ndarray:
    """Cell of each position, (..., 2)."""
    return np.asarray(np.floor(pos[..., :2] + 0.5)).astype(np.int64)


def are_inside(cells: np.ndarray) -> np.ndarray:
    """Whether cells are in the room, (...)."""
    return np.asarray(((cells >= 0) & (cells < SIDE)).all(axis=-1))


def n_robots(cells: np.ndarray, there: np.ndarray) -> np.ndarray:
    """Number of robots by cell, (W, SIDE, SIDE), from cells (W, A, 2) and who is there, (W, A)."""
    out = np.zeros((len(cells), SIDE, SIDE))
    world, agent = np.nonzero(there & are_inside(cells))
    np.add.at(out, (world, *cells[world, agent].T), 1.0)
    return out


def occupancy(simulation: Any) -> np.ndarray:
    """Number of robots in each cell, (W, cells)."""
    pos, there = simulation.read("robot.pos")
    return n_robots(cells_of(np.nan_to_num(pos)), there).reshape(len(pos), -1)


def filled(now: Situation) -> np.ndarray:
    """Share of the cells that hold a robot, (W, 1)."""
    return np.asarray((occupancy(now.simulation) > 0.0).mean(axis=1)[:, None])


def crowded(now: Situation) -> np.ndarray:
    """1 for a robot that shares its cell, (W, A)."""
    cells = cells_of(now.pos)
    inside = now.alive & are_inside(cells)
    x, y = np.where(inside[..., None], cells, 0).transpose(2, 0, 1)
    return np.asarray(inside & (n_robots(cells, now.alive)[np.arange(len(cells))[:, None], x, y] > 1.0))


class Dispersal(Task):
    """Robots enter a room one by one through a door, and make room for the next: they fill it (Hsiang and others 2004).

    Moves into walls and into cells that hold a robot are masked.
    """

    mission = room()
    learners = "robot"
    observation = {  # noqa: RUF012
        "own": Own("pos", scale=SIDE, planar=True),
        "near": NearestOthers(
            4, "offset present", radius=3.0, scale={"offset": 3.0}, frame="world", planar=True
        ),
    }
    state = Computed(SIDE * SIDE, occupancy, low=0.0)
    action = (Act("velocity_x velocity_y", levels=MOVES.tolist()),)
    reward = {"filled": Term(filled, 0.1), "crowded": Term(crowded, -0.1)}  # noqa: RUF012
    decide_every = 10

    def action_mask(self, now: Situation) -> Any:
        after = cells_of(now.pos)[:, :, None] + MOVES
        inside = are_inside(after)
        x, y = np.where(inside[..., None], after, 0).transpose(3, 0, 1, 2)
        taken = n_robots(cells_of(now.pos), now.alive)[np.arange(len(after))[:, None, None], x, y] > 0.0
        return (inside & ~taken) | (MOVES == 0).all(axis=-1)


__all__ = ["Dispersal"]
