"""BulletCollision with vehicles that follow commands: they drive into walls, posts and each other, are held there, and slide."""

from __future__ import annotations

import numpy as np
import pytest

from tussle import Block, Mission, Simulation
from tussle.api import Autonomy, Output, State
from tussle.plugins import stock
from tussle.scene import Cuboid, HeightField, Plane, Prism, Scene, Sphere, TriangleMesh

RADIUS = 0.3
SLACK = 0.05 * RADIUS


class Velocity(Autonomy):
    """Commands a constant velocity, whatever is in the way."""

    to = State("x y z", unit="m/s")
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    def step(self, g):
        self.velocity[:] = self.to


class Drive(Autonomy):
    """Commands a constant speed."""

    to = State("x y z", unit="m/s")
    speed = Output(unit="m/s")
    turn_rate = Output(unit="rad/s")
    pitch_rate = Output(unit="rad/s")

    def step(self, g):
        self.speed[:] = self.to[0]


class Steer(Autonomy):
    """Commands a constant speed of a car."""

    to = State("x y z", unit="m/s")
    speed = Output(unit="m/s")
    steering = Output(unit="rad")

    def step(self, g):
        self.speed[:] = self.to[0]


VEHICLES = {
    "SingleIntegrator": (Velocity, stock.SingleIntegrator(max_speed=-1.0)),
    "Unicycle": (Drive, stock.Unicycle(vel_max=1e4)),
    "SimpleCar": (Steer, stock.SimpleCar()),
}


def drive(
    scene, *vehicles, kind="SingleIntegrator", steps=60, substeps=1, seeds=1, threads=1, paces=1.0, **block
):
    """Positions by step of vehicles, each a place and a velocity, (steps, 3, n); of the last world.

    `paces` multiply the velocities, by world.
    """
    autonomy, motion = VEHICLES[kind]
    blocks = [
        Block(
            name=f"a{i}", team=i + 1, position=at, variance=(0, 0, 0), radius=RADIUS, autonomy=autonomy(), motion=motion, **block
        )
        for i, (at, _) in enumerate(vehicles)
    ]  # fmt: skip
    game = Mission(
        blocks=blocks, dt=0.1, end=1e3, motion_multiplier=substeps, scene=scene, interactions=[stock.BulletCollision()],
        networks=[stock.GlobalNetwork(), stock.LocalNetwork()],
    )  # fmt: skip
    sim, path = Simulation(game, seeds, threads=threads), []
    for i, (_, velocity) in enumerate(vehicles):
        sim.write(
            f"a{i}.{autonomy.__name__}.to",
            np.multiply.outer(paces, [velocity]) if np.ndim(paces) else velocity,
        )
    for _ in range(steps):
        sim.step()
        path.append(sim.state.population.bodies.pos[:, -len(vehicles) :].copy())
    return np.array(path)


def wall(thickness, at=20.0):
    return Scene(walls=[Cuboid((at + thickness / 2, 0, 1), (thickness, 400, 40))])


@pytest.mark.parametrize("speed", [1.0, 2.0, 3.0, 10.0, 300.0])
@pytest.mark.parametrize("thickness", [0.05, 0.2, 5.0])
@pytest.mark.parametrize("kind", VEHICLES)
def test_no_vehicle_drives_through_a_wall(kind, thickness, speed):
    for substeps in (1, 5):
        start, steps = (19.0, 0.0, 1.0), min(int(8.0 / speed / 0.1) + 8, 100)
        path = drive(wall(thickness), (start, (speed, 0, 0)), kind=kind, steps=steps, substeps=substeps)
        assert path[:, 0].max() <= 20.0 - RADIUS + SLACK
        assert path[-1, 0, 0] == pytest.approx(19.7, abs=SLACK)


SOLIDS = {
    "post": (Scene(walls=[Sphere((20, 0, 1), 0.2)]), 19.5),
    "square post": (Scene(walls=[Prism(((19.9, -0.1), (20.1, -0.1), (20.1, 0.1), (19.9, 0.1)), low=-5, high=5)]), 19.6),
    "mesh": (Scene(meshes=[TriangleMesh(np.array([[20, -50, -50], [20, 50, -50], [20, 0, 80.0]]), np.array([[0, 1, 2]]))]), 19.7),
    "half-space": (Scene(walls=[Plane((20, 0, 0), (-1, 0, 0))]), 19.7),
}  # fmt: skip


@pytest.mark.parametrize("speed", [2.0, 30.0, 1000.0])
@pytest.mark.parametrize("solid", SOLIDS)
def test_whatever_is_solid_holds_them(solid, speed):
    scene, limit = SOLIDS[solid]
    path = drive(scene, ((18.0, 0, 1), (speed, 0, 0)), steps=min(int(6.0 / speed / 0.1) + 8, 60))
    assert path[:, 0].max() <= limit + SLACK


@pytest.mark.parametrize("speed", [5.0, 50.0, 300.0])
def test_terrain_holds_them(speed):
    field = HeightField(np.random.default_rng(1).normal(0, 1, (41, 41)), -50.0, -50.0, 2.5)
    path = drive(Scene(terrain=field), ((0, 0, 20), (0.3 * speed, 0, -speed)), steps=60)
    x, y, z = path[-1, :, 0]
    assert Scene(terrain=field).height(x, y)[()] < z
    assert path[:, 2].min() > -2.0


def test_they_slide_along_a_wall_and_stop_in_a_corner_and_between_walls_that_meet():
    one = wall(0.2)
    path = drive(one, ((0, 0, 1), (20, 10, 0)), steps=100)
    assert path[-1, :, 0] == pytest.approx([19.7, 100.0, 1.0], abs=SLACK)
    corner = Scene(walls=[*one.walls, Cuboid((0, 20.1, 1), (400, 0.2, 40))])
    for velocity in ((20, 10, 0), (50, 49, 0), (300, 7, 0)):
        path = drive(corner, ((0, 0, 1), velocity), steps=300 if velocity[1] < 9 else 60)
        assert path[:, :2].max() <= 19.7 + SLACK
        assert path[-1, :2, 0] == pytest.approx([19.7, 19.7], abs=SLACK)
    wedge = Scene(walls=[Cuboid((20, s, 1), (40, 0.1, 40), (0, 0, -0.06 * s)) for s in (1.0, -1.0)])
    for speed in (50, 300):
        path = drive(wedge, ((0, 0, 1), (speed, 0.1 * speed, 0)))
        assert path[-1, 0, 0] < 34.0
        assert abs(path[:, 1]).max() < 1.9


@pytest.mark.parametrize("speed", [2.0, 10.0, 100.0])
def test_they_do_not_drive_through_each_other(speed):
    steps = min(int(8.0 / speed / 0.1) + 10, 60)
    meet = drive(Scene(), ((-1.5, 0, 1), (speed, 0, 0)), ((1.5, 0, 1), (-speed, 0, 0)), steps=steps)
    assert (meet[:, 0, 1] - meet[:, 0, 0] >= 2 * RADIUS - SLACK).all()
    parked = drive(Scene(), ((-1.5, 0, 1), (speed, 0, 0)), ((1.5, 0, 1), (0, 0, 0)), steps=steps)
    assert (parked[:, 0, 1] - parked[:, 0, 0] >= 2 * RADIUS - SLACK).all()


def test_a_box_is_held_too():
    for speed in (2.0, 30.0, 300.0):
        path = drive(wall(0.2), ((17.0, 0, 1), (speed, 0, 0)), steps=30, box=(2.0, 1.0, 0.8))
        assert path[:, 0].max() <= 19.0 + SLACK


def test_the_same_alone_in_a_stack_and_in_threads():
    chance = np.random.default_rng(3)
    scene = Scene(
        walls=[Cuboid((x, y, 0), (0.2, 3, 9), (0, 0, x)) for x, y in chance.uniform(-9, 9, (12, 2))]
    )
    crowd = [((x, y, 1.0), (u, v, 0.0)) for x, y, u, v in chance.uniform(-12, 12, (20, 4)) * [1, 1, 4, 4]]
    alone = drive(scene, *crowd, steps=30)
    for paces in (
        1.0,
        [50.0, 0.1, 1.0],
        [0.01, 9.0, 1.0],
    ):  # a faster world takes more pieces and more searches
        stacked = drive(scene, *crowd, steps=30, seeds=[5, 6, 1], threads=2, paces=paces)
        assert stacked.tobytes() == alone.tobytes()
    assert np.isfinite(alone).all()
