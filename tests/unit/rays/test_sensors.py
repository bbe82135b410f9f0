"""Lidar, radar altimeter, the car that avoids walls, and hills by a plugin."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from small_worlds import Drift, mission

from tussle import Block, Simulation
from tussle.api import Autonomy, Output, Param, Sensor, State, Subscribe
from tussle.errors import TussleError
from tussle.messages import PointCloud
from tussle.mission import read_mission
from tussle.scene import Cuboid, FlatGround, Scene
from tussle.stock import (
    AltitudeAboveTerrain,
    AvoidWalls,
    LOSSensor,
    RayTrace,
    SimpleCar,
    SimpleCarControllerHeading,
    SingleIntegrator,
    TerrainGenerator,
)
from tussle.view.scenery import scenery_of

FIELDS = "x y z range in_range"
ROOM = Scene(
    walls=[Cuboid((10, 0, 0), (2, 100, 100)), Cuboid((0, 20, 0), (100, 2, 100))], ground=FlatGround(-5.0)
)


def flyer(*sensors, to=(0.0, 0.0, 0.0), autonomy=(), **rest):
    return Block(
        name="r", sensor=sensors, autonomy=[Drift(to=to), *autonomy], motion=SingleIntegrator(), **rest
    )


def scan_of(sensor, seeds=(1,), compat="", **rest):
    sim = Simulation(mission(flyer(sensor, **rest), scene=ROOM, compat=compat), seeds=list(seeds))
    sim.step()
    return sim.read("r.RayTrace.points")[0]


def test_the_pattern_of_a_lidar():
    scan = scan_of(
        RayTrace(
            num_rays_vert=3, angle_res_vert="30 deg", num_rays_horiz=5, angle_res_horiz="45 deg", max_range=22
        )
    )[0, 0]
    x, y, z, distance, in_range = scan.reshape(5, 3, 5)
    ways = np.array(
        [
            [
                (math.cos(e) * math.cos(a), math.cos(e) * math.sin(a), math.sin(e))
                for a in np.radians([-90, -45, 0, 45, 90])
            ]
            for e in np.radians([30, 0, -30])
        ]
    )
    expected = ROOM.cast(np.zeros((3, 15)), ways.reshape(-1, 3).T, 22.0).distance.reshape(3, 5)
    np.testing.assert_allclose(distance, np.where(expected <= 22, expected, np.inf), rtol=1e-12)
    assert (in_range == (expected <= 22)).all()
    np.testing.assert_allclose(
        np.stack([x, y, z], axis=-1), ways * np.minimum(distance, 22.0)[..., None], atol=1e-12
    )
    assert distance[1].round(6).tolist() == [
        math.inf,
        round(9 * math.sqrt(2), 6),
        9.0,
        round(9 * math.sqrt(2), 6),
        19.0,
    ]
    assert distance[2, 2] == pytest.approx(10.0)  # the ground, 5 m below, at 30 degrees


def test_a_mounted_lidar_measures_in_the_body_frame():
    # At 2 m to the left of the body, looking down: the ground is 5 m below, wherever the body heads.
    sensor = RayTrace(num_rays_horiz=1, xyz=(0.0, 2.0, 1.0), rpy=(0.0, math.pi / 2, 0.0))
    scan = scan_of(sensor, heading="70 deg")[0, 0]
    assert scan[:, 0] == pytest.approx([0.0, 2.0, -5.0, 6.0, 1.0], abs=1e-12)
    turned = scan_of(RayTrace(num_rays_horiz=1, xyz=(1.0, 0.0, 0.0)), heading="90 deg")[0, 0]
    assert turned[:, 0] == pytest.approx([19.0, 0.0, 0.0, 18.0, 1.0], abs=1e-12)


@pytest.mark.parametrize(("compat", "near", "far"), [("", -math.inf, math.inf), ("scrimmage", 30.0, 30.0)])
def test_what_is_too_near_differs_from_what_is_not_there(compat, near, far):
    ends = {"num_rays_horiz": 1, "scan_period": 0.0}
    scan = scan_of(RayTrace(min_range=9.5, **ends), compat=compat)[0, 0]
    assert scan[:, 0].tolist() == [9.5 if not compat else 30.0, 0.0, 0.0, near, 0.0]
    nothing = scan_of(RayTrace(max_range=8.5, **ends), compat=compat)[0, 0]
    assert nothing[:, 0].tolist() == [8.5, 0.0, 0.0, min(far, 8.5) if compat else far, 0.0]
    just = scan_of(RayTrace(min_range=9.0, max_range=9.0, **ends), compat=compat)[0, 0]
    assert just[3:, 0].tolist() == [9.0, 1.0]


def test_noise_and_lost_returns():
    scans = scan_of(
        RayTrace(num_rays_horiz=201, angle_res_horiz=1e-9, range_noise=0.5, dropout=0.25), seeds=range(50)
    )
    distance, in_range = np.stack([scan[3:] for scan in scans[:, 0]], axis=1).reshape(2, -1)
    assert 1.0 - in_range.mean() == pytest.approx(0.25, abs=0.02)
    assert distance[in_range > 0].mean() == pytest.approx(9.0, abs=0.03)
    assert distance[in_range > 0].std() == pytest.approx(0.5, abs=0.02)
    assert np.isnan(distance[in_range == 0]).all()


class Hear(Autonomy):
    """Counts scans and their points."""

    heard = Subscribe(PointCloud, network="LocalNetwork")
    n = State("scans points", dtype=int)

    def step(self, g):
        rows, heard = self.heard.pairs()
        np.add.at(self.n[0], rows, 1)
        np.add.at(self.n[1], rows, heard.points.count)


def test_scans_are_timed_and_sent():
    sensor = RayTrace(scan_period=0.25, publish_on_local_networks=True)
    late = flyer(sensor, autonomy=[Hear()], to=(1.0, 0.0, 0.0), count=3, rate=2.0, slots=1, first_birth=0.15)
    sim = Simulation(mission(late, scene=ROOM, dt=0.1, end=3.0))
    seen = []
    for _ in range(30):
        sim.step()
        lists, alive = sim.read("r.RayTrace.points")
        seen.append(
            [
                tuple(each[3, :1]) if ok and each.shape[1] else None
                for each, ok in zip(lists[0], alive[0], strict=True)
            ]
        )
    counts = sim.read("r.Hear.n")[0][0]
    for who in range(3):
        scans = [row[who] for row in seen if row[who]]
        changes = 1 + sum(a != b for a, b in itertools.pairwise(scans))
        assert changes == pytest.approx(len(scans) / 2.5, abs=1.0)
        assert abs(int(counts[who][0]) - changes) <= 1
        assert counts[who][1] == 20 * counts[who][0]


def test_what_sees_entities():
    other = Block(
        name="o",
        position=(5.0, 0.0, 0.0),
        radius=1.0,
        autonomy=Drift(to=(0.0, 0.0, 0.0)),
        motion=SingleIntegrator(),
    )
    for sensor, distance in (
        (RayTrace(num_rays_horiz=1), 4.0),
        (RayTrace(num_rays_horiz=1, sees_entities=False), 9.0),
    ):
        sim = Simulation(mission(flyer(sensor), other, scene=ROOM))
        sim.step()
        assert sim.read("r.RayTrace.points")[0][0, 0][3, 0] == distance


def test_altimeters():
    hills = TerrainGenerator(
        x_length=40, y_length=40, x_resolution=2, y_resolution=2, z_std=2, center=(0, 0, 5), seed=3
    )
    radar = AltitudeAboveTerrain(altitude_noise=(1.0, 0.5))
    exact = dict.fromkeys(
        ("probability_of_error", "probability_oor_error", "range_sd_min", "range_sd_per_unit"), 0.0
    )
    laser = LOSSensor(rpy=(0.0, math.pi / 2, 0.0), use_flat_earth=False, max_range=100, **exact)
    block = flyer(
        radar,
        laser,
        count=30,
        placement="uniform",
        half_width=(15.0, 15.0, 1.0),
        position=(0.0, 0.0, 40.0),
        scatter_first=True,
    )
    game = mission(block, interactions=[hills])
    sim = Simulation(game, seeds=range(20))
    sim.step()
    pos = sim.read("r.pos")[0].reshape(-1, 3)
    true = sim.read("r.AltitudeAboveTerrain.true_altitude_above_terrain")[0].ravel()
    np.testing.assert_allclose(true, sim.read("r.LOSSensor.los_range")[0].ravel(), rtol=1e-9)
    measured = sim.read("r.AltitudeAboveTerrain.altitude_above_terrain")[0].ravel()
    field = hills.terrain()
    near = (
        np.round((pos[:, 0] - field.west) / 2).astype(int),
        np.round((pos[:, 1] - field.south) / 2).astype(int),
    )
    steps = max(np.abs(np.diff(field.height, axis=k)).max() for k in (0, 1))
    assert (np.abs(pos[:, 2] - true - field.height[near[1], near[0]]) <= 2 * steps).all()
    assert (measured - true).mean() == pytest.approx(1.0, abs=0.1)
    assert (measured - true).std() == pytest.approx(0.5, abs=0.05)
    assert scenery_of(game).terrain.height.shape == (21, 21)
    flat = Simulation(mission(flyer(AltitudeAboveTerrain(), position=(0.0, 0.0, 12.0))))
    flat.step()
    assert flat.read("r.AltitudeAboveTerrain.true_altitude_above_terrain")[0][0, 0] == 12.0
    for wrong, message in (
        (hills.replace(y_resolution=1), "must be equal"),
        (hills.replace(x_length=1e6, y_length=1e6), "at most 4,000,000"),
    ):
        with pytest.raises(TussleError, match=message):
            Simulation(game.replace(interactions=[wrong]))
    (note,) = scenery_of(game.replace(interactions=[hills.replace(y_resolution=1)])).notes
    assert note.endswith("must be equal; its terrain is not shown")
    with pytest.raises(TussleError, match="the scene has two terrains"):
        Simulation(game.replace(interactions=[hills, hills.replace(name="more")]))


class Fake(Sensor):
    """Writes a scan by hand."""

    raytrace = Output("raytrace", fields=FIELDS, unit="m m m m 1", ragged=True)
    scan = Param((), fields=FIELDS, unit="m m m m 1", ragged=True)

    def step(self, g):
        self.raytrace.set(self.scan.start, self.scan.data)


@pytest.mark.parametrize(
    ("scan", "heading", "speed"),
    [
        ([(30, 0, 0, 30, 0), (0, 25, 0, 25, 1)], 90.0, 24.3),  # nothing near: straight on
        (
            [(0, 5, 0, 5, 1), (30, 0, 0, 30, 0)],
            0.0,
            10.0,
        ),  # a wall on the left of a car that heads north: to the east
        (
            [(0, 10, 0, 10, 1), (0, -5, 0, 5, 1), (30, 0, 0, 30, 0)],
            180.0,
            10.0,
        ),  # 10 m left repels with 10, 5 m right with 15
        ([(5, 0, 0, 5, 1), (0, 5, 0, 5, 1)], 0.0, 10.0),  # all near: to the right
        ([], 90.0, 24.3),
    ],
)
def test_scripted_decisions_of_avoid_walls(scan, heading, speed):
    car = Block(
        name="r",
        heading="90 deg",
        sensor=Fake(scan=scan),
        autonomy=AvoidWalls(),
        controller=SimpleCarControllerHeading(),
        motion=SimpleCar(),
    )
    sim = Simulation(mission(car))
    sim.step()  # the car sees nothing yet
    sim.step()
    assert math.degrees(sim.read("r.AvoidWalls.desired_heading")[0][0, 0]) == pytest.approx(heading)
    assert sim.read("r.AvoidWalls.desired_speed")[0][0, 0] == speed


def test_a_car_stays_in_its_corridor(tmp_path):
    path = tmp_path / "corridor.xml"
    path.write_text("""<runscript><run dt="0.05" end="20"/><ground>0</ground>
<wall center="0 60 5" lengths="120 2 10"/><wall center="0 -60 5" lengths="120 2 10"/>
<wall center="60 0 5" lengths="2 120 10"/><wall center="-60 0 5" lengths="2 120 10"/>
<entity><team_id>1</team_id><count>5</count><z>1</z><variance_x>400</variance_x><variance_y>400</variance_y><variance_heading>8000</variance_heading>
<motion_model>SimpleCar</motion_model><controller p_gain="1.5">SimpleCarControllerHeading</controller>
<sensor angle_res_horiz="12" num_rays_horiz="21" max_range="40">RayTrace</sensor><autonomy>AvoidWalls</autonomy></entity></runscript>""")
    sim = Simulation(read_mission(path).mission, seeds=[1, 2])
    travelled, last = 0.0, sim.read("team_1.pos")[0]
    for _ in range(400):
        sim.step()
        pos = sim.read("team_1.pos")[0]
        assert np.abs(pos[..., :2]).max() < 59.0
        travelled, last = travelled + np.linalg.norm(pos - last, axis=-1).min(), pos
    assert travelled > 150.0


class Burst(Autonomy):
    """Flies on, in the second world to nowhere: its velocity overflows."""

    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    def step(self, g):
        self.velocity[:] = np.where(g.world == 1, 1e308, 1.0)
        if (g.step_count > 1).any():
            self.velocity[:] *= np.where(g.world == 1, -1e308, 1.0)


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_a_world_that_is_not_finite_ends_alone():
    sensors = RayTrace(), AltitudeAboveTerrain(), LOSSensor()
    block = Block(name="r", count=2, sensor=sensors, autonomy=Burst(), motion=SingleIntegrator())
    sim = Simulation(mission(block, scene=ROOM), seeds=[1, 2, 3], on_error="record")
    sim.step(8)
    assert sim.state.failed.tolist() == [False, True, False]
    assert "not a finite number" in str(sim.result()[1].error) or "not finite" in str(sim.result()[1].error)
