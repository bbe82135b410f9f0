"""Flight by lidar, collisions with the scene, and arrivals."""

from __future__ import annotations

import math

import numpy as np
import pytest
from small_worlds import Drift, mission

from tussle import Block, Simulation
from tussle.scene import Cuboid, Scene
from tussle.stock import Arrivals, GoToByLidar, RayTrace, SceneCollision, SingleIntegrator

WALL = Scene(walls=[Cuboid((40, 5, 0), (2, 40, 40))])
LIDAR = RayTrace(num_rays_horiz=120, angle_res_horiz="3 deg", max_range=60.0, scan_period=0.0)


def flown(scene, lidar=LIDAR, *, count=1, goal=(80.0, 0.0, 0.0), **law):
    """Paths, (T, worlds, count, 3), and the result, of flights over 80 m to the East."""
    block = Block(
        name="r", team=1, count=count, radius=0.5, sensor=lidar, motion=SingleIntegrator(),
        autonomy=GoToByLidar(goal=goal, speed=10.0, **law),
    )  # fmt: skip
    game = mission(
        block, scene=scene, dt=0.1, end=20.0, interactions=[SceneCollision()], metrics=[Arrivals()]
    )
    sim = Simulation(game.replace(end_conditions="time"), seeds=[1])
    path = []
    while not sim.is_over:
        sim.step()
        path.append(sim.read("r.pos")[0][0])
    return np.array(path), sim.result()[0]


def test_it_goes_round_a_wall_on_the_shorter_side_and_stops_at_the_goal():
    path, result = flown(WALL)
    x, y = path[:, 0, 0], path[:, 0, 1]
    beside = np.abs(x - 40.0) < 1.0
    assert (y[beside] < -15.0 - 1.5).all()  # the wall ends at -15 and at 25; the clearance is 2 m
    assert np.hypot(x[-1] - 80.0, y[-1]) < 0.5
    assert result.alive == {1: 1}
    assert result.metrics["Arrivals"]["arrived"] == {1: 1}
    time = result.metrics["Arrivals"]["mean_time"][1]
    first = np.flatnonzero(np.hypot(x - 80.0, y) <= 3.0)[0]
    assert time == pytest.approx(0.1 * (first + 1), abs=0.05)
    assert time > 8.0  # longer than straight on


def test_without_a_wall_it_flies_straight_and_one_that_sees_nothing_hits_the_wall():
    path, result = flown(Scene())
    np.testing.assert_allclose(path[:, 0, 1], 0.0, atol=1e-9)
    assert result.metrics["Arrivals"]["mean_time"][1] < 9.0
    _, blind = flown(WALL, LIDAR.replace(max_range=0.6))
    assert blind.alive == {1: 0}
    assert blind.metrics["Arrivals"]["arrived"] == {1: 0}
    assert math.isnan(blind.metrics["Arrivals"]["mean_time"][1])


def test_a_wall_nearer_than_the_least_range_is_not_flown_into():
    # 0.9 m beside the start, and too near to be measured; the goal lies behind it.
    beside = Scene(walls=[Cuboid((4.5, 2.0, 0.0), (13.0, 1.0, 40.0))])
    _, result = flown(beside, LIDAR.replace(min_range=3.0), goal=(2.0, 30.0, 0.0))
    assert result.alive == {1: 1}


def test_it_slows_down_before_a_dead_end():
    """In a pocket that is closed on three sides the speed is one from which it stops."""
    walls = [
        Cuboid((40, 0, 0), (2, 300, 40)),
        Cuboid((0, 20, 0), (90, 2, 40)),
        Cuboid((0, -20, 0), (90, 2, 40)),
    ]
    path, result = flown(Scene(walls=walls), deceleration=2.0)
    speed = np.linalg.norm(np.diff(path[:, 0], axis=0), axis=1) / 0.1
    free = 39.0 - path[:-1, 0, 0] - 2.0
    towards = np.diff(path[:, 0, 0]) > 0.9 * 0.1 * speed
    assert result.alive == {1: 1}
    assert (speed[towards] ** 2 / 4.0 <= np.maximum(free[towards], 0.0) + 0.3).all()


def test_who_touches_a_building_or_flew_through_a_thin_wall_is_removed():
    def left(to, radius=0.5, **room):
        block = Block(name="r", team=1, radius=radius, autonomy=Drift(to=to), motion=SingleIntegrator())
        thin = Scene(walls=[Cuboid((10, 0, 0), (0.01, 10, 10))])
        game = mission(block, scene=thin, dt=0.1, end=3.0, interactions=[SceneCollision(**room)])
        return Simulation(game.replace(end_conditions="time"), seeds=1).run()[0].alive[1]

    assert left((100.0, 0.0, 0.0)) == 0  # 10 m in a step
    assert left((3.0, 0.0, 0.0)) == 1  # 9 m in all
    assert left((3.0, 0.0, 0.0), radius=1.5) == 0
    assert left((3.0, 0.0, 0.0), margin=1.0) == 0
    with pytest.warns(RuntimeWarning, match="SceneCollision.team = 2: no block has this team"):
        assert left((100.0, 0.0, 0.0), team=2) == 1
