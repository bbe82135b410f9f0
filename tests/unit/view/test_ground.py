"""Where a shipped mission or an example has a ground, nobody is below it; where it has none, the page says so."""

from __future__ import annotations

import numpy as np
import pytest

from tussle import Simulation
from tussle.mission import Block, Mission, read_mission, shipped_missions
from tussle.plugins import stock
from tussle.scene import Scene, TriangleMesh
from tussle.view import scenery_of
from tussle.world.shapes import FlatGround

SOURCES = {**{name: path for name, (path, _) in shipped_missions().items()}, **stock.examples()}
SECONDS, MOST = 30.0, 20
"""Simulated time, and entities of a block."""
MIN_RADIUS = 0.5
"""An entity on the ground may lie half in it [m]."""


def is_grounded(mission: Mission) -> bool:
    """Its scene or plugins say where the ground is, and it needs no other program."""
    return scenery_of(mission).has_ground and all(plugin.grade != "external" for plugin in mission.plugins)


GROUNDED = [
    "car_maze",
    "dozers",
    "fixed_wing_6dof",
    "formation_flight",
    "urban_quadrotors",
    "GoToByLidar",
    "SimpleCar",
    "Ballistic",
    "RayTrace",
    "DepthCamera",
    "AltitudeAboveTerrain",
    "BulletCollision",
    "GroundCollision",
    "SceneCollision",
    "ExternalForceField",
    "TerrainGenerator",
    "SimpleCollisionMetrics",
]
"""Missions and examples with a ground."""


def test_missions_with_a_ground_are_known():
    assert [name for name, path in SOURCES.items() if is_grounded(read_mission(path).mission)] == GROUNDED


def test_a_terrain_that_is_a_mesh_is_a_ground():
    """As <terrain> reads poly data of SCRIMMAGE."""
    hill = TriangleMesh(((0.0, 0.0, 0.0), (9.0, 0.0, 0.0), (0.0, 9.0, 0.0)), ((0, 1, 2),))
    blocks = [Block(name="a", autonomy=stock.Straight(), motion=stock.SingleIntegrator())]
    assert not scenery_of(Mission(blocks=blocks)).has_ground
    assert scenery_of(Mission(blocks=blocks, scene=Scene(meshes=[hill]))).has_ground


@pytest.mark.parametrize("name", GROUNDED)
def test_nobody_sinks_below_the_ground(name):
    loaded = read_mission(SOURCES[name])
    mission = loaded.mission
    blocks = [block.replace(count=min(block.count, MOST)) for block in mission.blocks]
    with Simulation(mission.replace(blocks=blocks), loaded.seed) as simulation:
        scene = simulation.state.context.scene
        levels = [
            p.values["ground_collision_z"] for p in mission.interactions if "ground_collision_z" in p.values
        ]
        ground = Scene(ground=scene.ground or FlatGround(max(levels, default=-1e6)), terrain=scene.terrain)
        for _ in range(round(min(mission.end - mission.start, SECONDS) / mission.dt / 10)):
            simulation.step(10)
            bodies = simulation.state.population.bodies
            height = bodies.pos[2] - ground.height(*bodies.pos[:2])
            assert (height >= -np.maximum(bodies.radius, MIN_RADIUS)).all()
