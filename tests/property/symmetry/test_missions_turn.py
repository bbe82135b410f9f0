"""Turn, shift or mirror a mission and its result turns, shifts or is mirrored with it; in what order blocks are written is no matter.

Within rounding: cells are fixed in the world, so a turned swarm adds up in another order. What differs at first by 1e-14 m is found to
differ by 2e-12 m at the end; the tolerance leaves room for other orders of sums and none for a wrong law.
"""

from __future__ import annotations

import dataclasses
import math
from functools import cache

import numpy as np
import pytest

from tussle import Block, Mission, Simulation
from tussle.stock import (
    AvoidEntityMS,
    Boids,
    Boundary,
    MotorSchemas,
    MoveToGoalMS,
    Predator,
    SimpleAircraft,
    SimpleAircraftControllerPID,
    SimpleCapture,
    SingleIntegrator,
    Straight,
    Unicycle,
    UnicyclePID,
)

GOAL = (300.0, 120.0, 150.0)


def places(count: int, size: float, height: float) -> np.ndarray:
    """Fixed positions [m], (count, 3), and headings [rad] in a fourth column: no two alike, no symmetry of their own."""
    golden = (math.sqrt(5.0) - 1.0) / 2.0
    i = np.arange(1, count + 1)
    u = np.array(
        [
            (i * golden) % 1.0,
            (i * golden**2 * 1.7) % 1.0,
            (i * math.sqrt(2.0)) % 1.0,
            (i * math.sqrt(3.0)) % 1.0,
        ]
    )
    return np.array(
        [size * (u[0] - 0.5), size * (u[1] - 0.5), height + 0.2 * size * (u[2] - 0.5), 6.0 * (u[3] - 0.5)]
    ).T


def one_each(name: str, spots: np.ndarray, **values) -> list[Block]:
    """A block for each spot."""
    return [
        Block(name=f"{name}{i}", position=tuple(spot[:3]), heading=float(spot[3]), **values)
        for i, spot in enumerate(spots)
    ]


def boids(goal):
    return Boids(goal=goal, use_initial_heading=False, comms_range=80.0)


def chase(goal):
    prey = Unicycle(vel_max=30.0, turn_rate_max=1.0, pitch_rate_max=1.0)
    hunter = Unicycle(vel_max=35.0, turn_rate_max=2.0, pitch_rate_max=1.5)
    far = places(30, 150.0, 200.0)
    far[25:, 0] += 120.0
    return Mission(
        blocks=[
            *one_each("prey", far[:25], team=1, autonomy=boids(goal), motion=prey),
            *one_each(
                "hunter",
                far[25:],
                team=2,
                autonomy=Predator(max_speed=35.0, capture_range=15.0),
                motion=hunter,
            ),
        ],
        motion_multiplier=3,
        interactions=[SimpleCapture(capture_range=15.0)],
    )


def points(goal):
    blocks = one_each(
        "point", places(25, 100.0, 100.0), team=1, autonomy=boids(goal), motion=SingleIntegrator()
    )
    return Mission(blocks=blocks)


def planes(goal):
    blocks = one_each(
        "plane",
        places(6, 300.0, 300.0),
        team=1,
        speed=22.4,
        roll=0.2,
        climb=0.1,
        autonomy=Straight(enable_boundary_control=True),
        controller=SimpleAircraftControllerPID(),
        motion=SimpleAircraft(),
    )
    fence = Boundary(shape="sphere", center=goal, radius=100.0)  # all start outside and turn to its centre
    return Mission(blocks=blocks, motion_multiplier=2, interactions=[fence])


def robots(goal):
    behaviors = [AvoidEntityMS(sphere_of_influence=40.0, gain=2.0), MoveToGoalMS(goal=goal)]
    motion = Unicycle(vel_max=15.0, turn_rate_max=1.0, pitch_rate_max=1.0)
    blocks = one_each(
        "robot",
        places(15, 80.0, 100.0),
        team=1,
        autonomy=MotorSchemas(max_speed=12.0, behaviors=behaviors),
        controller=UnicyclePID(),
        motion=motion,
    )
    return Mission(blocks=blocks, motion_multiplier=4)


def chase_in_turn(goal):
    return chase(goal).replace(update="sequential")


GAMES = {
    "chase": (chase, 30),
    "chase in turn": (chase_in_turn, 30),
    "points": (points, 30),
    "planes": (planes, 60),
    "robots": (robots, 40),
}


class Motion:
    """A motion of the whole mission: turn about the vertical, then mirror North and South, then shift."""

    def __init__(
        self, turn: float = 0.0, shift: tuple[float, ...] = (0.0, 0.0, 0.0), *, mirror: bool = False
    ) -> None:
        self.turn, self.shift, self.mirror = turn, np.array(shift), mirror

    def vector(self, v: np.ndarray) -> np.ndarray:
        """Of vectors, (..., 3)."""
        c, s = math.cos(self.turn), math.sin(self.turn)
        x, y, z = v[..., 0], v[..., 1], v[..., 2]
        turned = np.stack([c * x - s * y, s * x + c * y, z], axis=-1)
        return turned * np.array([1.0, -1.0, 1.0]) if self.mirror else turned

    def point(self, p) -> np.ndarray:
        return self.vector(np.asarray(p, float)) + self.shift

    def heading(self, yaw: float) -> float:
        return -(yaw + self.turn) if self.mirror else yaw + self.turn

    def mission(self, make) -> Mission:
        """The mission moved."""
        game = make(tuple(self.point(GOAL)))
        blocks = [
            dataclasses.replace(
                b,
                position=tuple(self.point(b.position)),
                heading=self.heading(b.heading),
                roll=-b.roll if self.mirror else b.roll,
            )
            for b in game.blocks
        ]
        return game.replace(blocks=blocks)


def trajectory(game: Mission, steps: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Positions, velocities and noses of all blocks, (steps, n_blocks, 3) each; NaN where nobody lives."""
    sim = Simulation(game, seeds=1)
    names = [b.name for b in game.blocks]
    found = []
    for _ in range(steps):
        sim.step()
        columns = []
        for column in ("pos", "vel", "forward"):
            read = [sim.read(f"{name}.{column}") for name in names]
            columns.append([values[0, 0] if alive[0, 0] else np.full(3, np.nan) for values, alive in read])
        found.append(columns)
    pos, vel, nose = np.moveaxis(np.array(found), 1, 0)
    return pos, vel, nose


@cache
def plain(name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The mission as it stands."""
    make, steps = GAMES[name]
    return trajectory(make(GOAL), steps)


def compare(moved, still, motion: Motion, tolerance: float) -> None:
    """Whether a moved mission's trajectory is the trajectory moved."""
    for now, wanted in zip(
        moved, (motion.point(still[0]), motion.vector(still[1]), motion.vector(still[2])), strict=True
    ):
        np.testing.assert_allclose(now, wanted, rtol=0.0, atol=tolerance)


MOTIONS = {
    "quarter turn": Motion(turn=math.pi / 2),
    "turn across West": Motion(turn=-2.9),
    "all at once": Motion(turn=2.0, shift=(-300.0, 55.5, 10.0), mirror=True),
}


@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("name", GAMES)
def test_result_moves_with_its_mission(name, motion):
    make, steps = GAMES[name]
    compare(trajectory(MOTIONS[motion].mission(make), steps), plain(name), MOTIONS[motion], 1e-9)


def test_games_are_worth_comparing():
    """Entities fly their own ways, turn, climb, and some are caught."""
    for name in GAMES:
        pos, _, nose = plain(name)
        assert np.nanmax(np.abs(pos[-1] - pos[0])) > 10.0
        assert np.nanmax(np.linalg.norm(nose[-1] - nose[0], axis=-1)) > 0.1
        assert np.nanstd(pos[-1] - pos[0], axis=0)[:2].min() > 0.01
    assert np.isnan(plain("chase")[0][-1]).any()


def test_historic_means_depend_on_where_east_is():
    """The law that the paper's code had, kept to reproduce it, fails where the corrected one passes."""

    def flock(goal):
        law = Boids(goal=goal, use_initial_heading=False, comms_range=80.0, averaging="historic")
        return Mission(
            blocks=one_each(
                "point", places(25, 100.0, 100.0), team=1, autonomy=law, motion=SingleIntegrator()
            )
        )

    turn = MOTIONS["turn across West"]
    moved, still = trajectory(turn.mission(flock), 10), trajectory(flock(GOAL), 10)
    assert np.abs(moved[0] - turn.point(still[0])).max() > 0.1


@pytest.mark.parametrize("name", [name for name in GAMES if name != "chase in turn"])
@pytest.mark.parametrize("order", ["reversed", "rotated"])
def test_order_of_blocks_is_no_matter(name, order):
    make, steps = GAMES[name]
    game = make(GOAL)
    n = len(game.blocks)
    index = list(range(n))[::-1] if order == "reversed" else [(i + n // 3) % n for i in range(n)]
    other = trajectory(game.replace(blocks=[game.blocks[i] for i in index]), steps)
    for now, wanted in zip(other, plain(name), strict=True):
        np.testing.assert_allclose(now, wanted[:, index], rtol=0.0, atol=1e-9)


def test_in_turn_the_order_of_blocks_does_matter():
    """Otherwise the test above would pass for an engine that ignores the order everywhere."""
    game = chase_in_turn(GOAL)
    forward, backward = (
        trajectory(game.replace(blocks=blocks), 10)[0] for blocks in (game.blocks, game.blocks[::-1])
    )
    assert np.nanmax(np.abs(forward - backward[:, ::-1])) > 1e-3


@pytest.mark.parametrize("multiplier", [1, 5])
def test_unicycle_flies_as_fast_as_commanded(multiplier):
    game = chase(GOAL).replace(motion_multiplier=multiplier)
    sim = Simulation(game, seeds=1)
    sim.step(10)
    for block, name in ((game.blocks[0], "Boids"), (game.blocks[-1], "Predator")):
        vel, _ = sim.read(f"{block.name}.vel")
        speed, _ = sim.read(f"{block.name}.{name}.speed")
        turn, climb = (
            sim.read(f"{block.name}.{name}.{rate}")[0][0, 0] for rate in ("turn_rate", "pitch_rate")
        )
        # vel is the chord of the last substep: shorter than the arc by (w h)^2 / 24 at most.
        chord = (turn**2 + climb**2) * (game.dt / multiplier) ** 2 / 24.0
        assert speed[0, 0] > 1.0
        assert np.linalg.norm(vel[0, 0]) == pytest.approx(speed[0, 0], rel=chord + 1e-9)


def test_a_pair_that_repels_keeps_its_centre():
    """Two equal boids without a goal push each other apart by the same amount."""
    law = Boids(goal_weight=0.0, centroid_weight=0.0, align_weight=0.0)
    spots = np.array([[-3.0, 1.0, 100.0, 0.3], [4.0, -2.0, 103.0, 2.0]])
    game = Mission(blocks=one_each("boid", spots, team=1, autonomy=law, motion=SingleIntegrator()))
    pos, vel, _ = trajectory(game, 5)
    np.testing.assert_allclose(vel.sum(axis=1), 0.0, atol=1e-9)
    np.testing.assert_allclose(
        pos.mean(axis=1), np.repeat(spots[:, :3].mean(axis=0)[None], 5, axis=0), atol=1e-9
    )
    assert np.linalg.norm(pos[-1, 0] - pos[-1, 1]) > np.linalg.norm(spots[0, :3] - spots[1, :3]) + 1.0
