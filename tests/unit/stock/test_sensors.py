"""GPS, SimpleINS, FieldOfView, ContactBlobCamera, LOSSensor: closed forms, shares and spreads."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tussle import Block, Mission, Scene, Simulation
from tussle.api import Autonomy, Output, Param, State, Subscribe
from tussle.errors import MissionError
from tussle.messages import GPSStatus
from tussle.mission import read_mission
from tussle.scene import Cuboid, FlatGround
from tussle.stock import (
    GPS,
    Boundary,
    ContactBlobCamera,
    ContactBlobCameraNoNoise,
    FieldOfView,
    LOSSensor,
    SimpleINS,
    SingleIntegrator,
    Still,
)


class Accelerate(Autonomy):
    """Flies north with a constant acceleration from rest."""

    accel = Param(0.5, unit="m/s^2")
    speed = Param(0.0, unit="m/s")
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    def step(self, g):
        self.velocity[1] = self.speed + self.accel * (g.t + g.dt)


def still(name, pos=(0.0, 0.0, 0.0), **values):
    return Block(name=name, position=pos, variance=(0.0, 0.0, 0.0), motion=Still(), **values)


def after(mission, steps=1, seed=1):
    sim = Simulation(mission, seed)
    sim.step(steps)
    return sim


def is_share(found, share, n):
    return abs(found - share * n) <= 5.0 * math.sqrt(n * share * (1.0 - share))


def is_spread(values, sd):
    """Whether the standard deviation is within five of its own standard deviations, sd / sqrt(2 n)."""
    return abs(np.std(values) / sd - 1.0) <= 5.0 / math.sqrt(2.0 * values.size)


# Cameras ---------------------------------------------------------------------------------------------------------


def placed(bearing, elevation, distance, yaw):
    """A position at angles [rad] and a distance [m] from a camera at the origin with this heading."""
    level = distance * math.cos(elevation)
    return level * math.cos(yaw + bearing), level * math.sin(yaw + bearing), distance * math.sin(elevation)


def test_a_field_of_view_lists_bearing_elevation_and_range():
    yaw, inside, outside = (
        0.5,
        [(0.7, 0.5, 80.0), (-0.7, -0.5, 99.0), (0.0, 0.0, 5.0)],
        [(0.8, 0.0, 50.0), (0.0, 0.55, 50.0)],
    )
    others = [
        still(f"o{i}", placed(*where, yaw), team=3)
        for i, where in enumerate([*inside, *outside, (0.1, 0.1, 101.0)])
    ]
    camera = FieldOfView(max_range=100.0, azimuth_fov=1.5)
    back = camera.replace(rpy=(0.0, 0.0, math.pi))
    blocks = still("c", heading=yaw, sensor=camera), still("b", heading=yaw + math.pi, sensor=back), *others
    sim = after(Mission(blocks=list(blocks)))
    for name in ("c", "b"):
        ids, team, *measured = sim.read(f"{name}.FieldOfView.seen")[0][0, 0]
        here = ids > 2  # the other camera is at distance 0
        order = np.argsort(ids[here])
        assert ids[here][order].tolist() == [3, 4, 5]
        assert set(team[here]) == {3}
        assert np.allclose(np.array(measured)[:, here][:, order].T, inside, rtol=0.0, atol=1e-12)
        assert sim.read(f"{name}.FieldOfView.n_seen")[0][0, 0] == len(ids)


def test_a_field_of_view_misses_some_and_errs():
    camera = FieldOfView(
        false_negative_probability=0.3, bearing_noise=0.02, elevation_noise=0.01, range_noise=0.1
    )
    blocks = still("c", sensor=camera), still("crowd", (100.0, 0.0, 0.0), count=2000)
    sim = after(Mission(blocks=list(blocks)))
    _, _, bearing, elevation, distance = sim.read("c.FieldOfView.seen")[0][0, 0]
    assert is_share(len(bearing), 0.7, 2000)
    for values, sd in ((bearing, 0.02), (elevation, 0.01), (distance / 100.0, 0.1)):
        assert is_spread(values, sd)


SHARP = {
    "false_negative_probability": 0.0,
    "false_positive_probability": 0.0,
    "pos_noise_0": (0, 0),
    "pos_noise_1": (0, 0),
}


def boxes(*others, **values):
    camera = still("c", sensor=ContactBlobCamera(**{**SHARP, **values}))
    sim = after(Mission(blocks=[camera, *others]))
    return sim.read("c.ContactBlobCamera.blobs")[0][0, 0]


def test_the_camera_without_noise_puts_boxes_on_true_centres():
    camera = still("c", sensor=ContactBlobCameraNoNoise())
    sim = after(Mission(blocks=[camera, still("o", (60.0, 0.0, 0.0))]))
    blobs = sim.read("c.ContactBlobCameraNoNoise.blobs")[0][0, 0]
    assert blobs.shape[1] == 1
    _, u, v, _, _ = blobs[:, 0]
    assert (u, v) == pytest.approx((400.0, 300.0))


def test_a_box_bounds_the_image_of_a_sphere():
    pos, radius = np.array([60.0, -8.0, 12.0]), 6.0
    (ids,), (u,), (v,), (width,), (height,) = boxes(still("o", tuple(pos), radius=radius))
    # Points on the silhouette, where rays are tangents: the sphere's points at a right angle to their own ray.
    axis = pos / np.linalg.norm(pos)
    sine = radius / np.linalg.norm(pos)
    side = np.cross(axis, [0.0, 0.0, 1.0])
    side /= np.linalg.norm(side)
    angle = np.linspace(0.0, 2.0 * math.pi, 100_001)
    ring = np.outer(side, np.cos(angle)) + np.outer(np.cross(axis, side), np.sin(angle))
    x, y, z = axis[:, None] * math.sqrt(1.0 - sine**2) + sine * ring
    half = math.tan(math.radians(22.5))
    across, down = 400.0 * (1.0 - y / x / half), 300.0 * (1.0 - z / x / half)
    assert ids == 2
    assert (u - width / 2, u + width / 2) == pytest.approx((across.min(), across.max()), abs=1e-4)
    assert (v - height / 2, v + height / 2) == pytest.approx((down.min(), down.max()), abs=1e-4)


def test_boxes_end_at_the_edges_of_the_image_and_cameras_are_mounted():
    _, (u,), (v,), (width,), (height,) = boxes(still("o", (10.0, 4.0, 0.0), radius=3.0))
    assert u - width / 2 == pytest.approx(0.0, abs=1e-9)
    assert v == pytest.approx(300.0)
    _, (u,), _, (width,), (height,) = boxes(still("o", (1.0, 0.0, 0.0), radius=3.0))
    assert (u, width, height) == (400.0, 800.0, 600.0)  # the camera is inside
    assert boxes(still("o", (-50.0, 0.0, 0.0))).shape == (5, 0)
    assert boxes(still("o", (-50.0, 0.0, 0.0)), rpy="0 0 180").shape == (5, 1)
    assert boxes(still("o", (0.0, 0.0, -50.0)), rpy=(0.0, math.pi / 2, 0.0))[1:3, 0] == pytest.approx(
        (400.0, 300.0)
    )
    assert boxes(still("o", (50.0, 0.0, 0.0)), ignore_real_entities=True).shape == (5, 0)


@pytest.mark.parametrize(
    ("way", "is_seen"),
    [
        ((1.0, 0.99, 0.4), True),
        ((1.0, -0.99, -0.4), True),
        ((1.0, 0.8, 0.5), False),  # 21 degrees above the horizontal plane, and 27 above the optical axis
        ((1.0, 0.0, 0.42), False),
        ((1.0, 1.01, 0.0), False),
    ],
)
def test_what_is_beyond_an_edge_of_the_image_is_not_in_it(way, is_seen):
    found = boxes(still("o", tuple(50.0 * np.array(way))), azimuth_fov="90", elevation_fov="45")
    assert found.shape == (5, is_seen)
    assert (found[3:] > 0.0).all()


def test_boxes_are_missed_err_and_are_invented():
    noise = {"pos_noise_0": (3.0, 2.0), "size_noise_1": (0.0, 4.0), "false_negative_probability": 0.2}
    ids, u, _, _, height = boxes(
        still("o", (500.0, 0.0, 0.0), count=2000, radius=30.0), **noise, false_positive_probability=0.4, max_false_positives_per_frame=1000
    )  # fmt: skip
    real = ids > 0
    assert is_share(real.sum(), 0.8, 2000)
    assert is_share((~real).sum(), 0.4, 1000)
    assert is_spread(u[real], 2.0)
    assert abs(u[real].mean() - 403.0) < 5.0 * 2.0 / math.sqrt(real.sum())
    assert is_spread(height[real], 4.0)
    assert is_spread(u[~real], 800.0 / math.sqrt(12.0))
    assert 0.2 <= height[~real].min() < 2.0 < 38.0 < height[~real].max() <= 40.0
    assert boxes(still("o", (-50.0, 0.0, 0.0)), max_false_positives_per_frame=0).shape == (5, 0)


# Navigation ------------------------------------------------------------------------------------------------------


class Logbook(Autonomy):
    """Counts the messages of its GPS."""

    n_fixed = State(dtype=int)
    n_heard = State(dtype=int)
    heard = Subscribe(GPSStatus, network="LocalNetwork")

    def step(self, g):
        rows, status = self.heard.latest()
        self.n_heard[rows] += 1
        self.n_fixed[rows] += status.has_fix


def test_gps_has_no_fix_in_denied_regions():
    """At 10 m/s it enters the sphere after 4 s and the box after 9 s, where it stays; the third region is not denied."""
    boat = Block(
        name="boat", count=1, motion=SingleIntegrator(), sensor=GPS(gps_denied_ids="1, 4"),
        autonomy=[Accelerate(accel=0.0, speed=10.0), Logbook()],
    )  # fmt: skip
    box = Boundary(boundary_id=4, center=(0.0, 100.0, 0.0), lengths=(20.0, 20.0, 20.0), name="box")
    sphere = Boundary(boundary_id=1, shape="sphere", center=(0.0, 50.0, 0.0), radius=10.0)
    free = Boundary(boundary_id=2, shape="sphere", center=(0.0, 20.0, 0.0), radius=9.0, name="free")
    other = still("other", (0.0, -9.0, 0.0), sensor=GPS())
    mission = Mission(blocks=[boat, other], interactions=[box, sphere, free], end=10.0)
    sim, fixes = Simulation(mission, 1), []
    for _ in range(95):
        sim.step()
        fixes.append(sim.read("boat.GPS.gps_fix")[0][0, 0])
        if fixes[-1]:
            last = sim.read("boat.pos")[0][0, 0]
    y = 1.0 * np.arange(1, 96)
    assert fixes == [float(not (40.0 < k < 60.0 or 90.0 < k < 110.0)) for k in np.round(y, 6)]
    expected = mission.scene.origin.to_geodetic(last)
    assert np.array_equal(sim.read("boat.GPS.coordinates")[0][0, 0], expected)
    assert sim.read("boat.GPS.gps_time")[0][0, 0] == pytest.approx(9.0)
    # Its own messages only, a step later.
    assert sim.read("boat.Logbook.n_heard")[0][0, 0] == 94
    assert sim.read("boat.Logbook.n_fixed")[0][0, 0] == sum(fixes[:-1])


def test_gps_errs_and_names_a_region_that_is_not_there():
    crowd = still("crowd", count=1000, sensor=GPS(noise=(3.0, 5.0, 10.0)))
    mission = Mission(blocks=[crowd])
    found = mission.scene.origin.from_geodetic(after(mission).read("crowd.GPS.coordinates")[0][0].T)
    assert all(is_spread(found[i], sd) for i, sd in enumerate((3.0, 5.0, 10.0)))
    for denied, said in (("7", "no boundaries of the mission have the id 7.*3"), ("3, x", "'x'")):
        with pytest.raises(MissionError, match=f"block 'a': GPS: .*{said}"):
            Mission(
                blocks=[still("a", sensor=GPS(gps_denied_ids=denied))], interactions=[Boundary(boundary_id=3)]
            )


QUIET = {f"{name}_{i}": (0.0, 0.0) for name in ("vel_noise", "orient_noise") for i in range(3)}


@pytest.mark.parametrize("dt", [0.1, 0.05])
def test_the_error_of_an_ins_is_a_random_walk_by_acceleration_whatever_the_step(dt):
    """Half a metre per second squared for 9 s: the standard deviation is 0.5 sd sqrt(9), and the variance its square."""
    ins = SimpleINS(**QUIET, pos_noise_0=(9.0, 9.0), pos_noise_1=(0.0, 2.0))
    crowd = Block(name="crowd", count=1000, autonomy=Accelerate(), motion=SingleIntegrator(), sensor=ins)
    sim = after(Mission(blocks=[crowd], dt=dt, end=20.0), round(9.0 / dt))
    error = sim.read("crowd.SimpleINS.belief_pos")[0][0].T - sim.read("crowd.pos")[0][0].T
    assert is_spread(error[1], 3.0)
    assert abs(error[1].mean()) < 5.0 * 3.0 / math.sqrt(1000)
    assert (error[0] == 0.0).all()  # no acceleration along x
    assert sim.read("crowd.SimpleINS.variance")[0][0, 0] == pytest.approx([1.0, 10.0])
    assert np.array_equal(sim.read("crowd.SimpleINS.belief_quat")[0], sim.read("crowd.quat")[0])


@pytest.mark.parametrize("ratio", [0.05, 0.3, 0.49, 0.51, 1.0])
def test_half_of_the_positions_are_within_the_cep(ratio):
    crowd = Block(name="c", autonomy=Accelerate(), motion=SingleIntegrator(), sensor=SimpleINS(**QUIET))
    sim = Simulation(Mission(blocks=[crowd]), 1)
    sim.write("c.Accelerate.accel", 0.0)
    sim.write("c.SimpleINS.variance", np.array([[[4.0, 4.0 * ratio**2]]]))
    sim.step()
    cep = sim.read("c.SimpleINS.ins_cep")[0][0, 0]
    angle = np.linspace(0.0, 2.0 * math.pi, 20_000, endpoint=False)
    # The probability within a radius, by the radial integral along each direction.
    rate = 0.5 * (np.cos(angle) ** 2 / 4.0 + np.sin(angle) ** 2 / (4.0 * ratio**2))
    inside = np.mean((1.0 - np.exp(-rate * cep**2)) / rate) / (4.0 * 4.0 * ratio) * 2.0
    assert inside == pytest.approx(0.5, abs=0.012)


def test_an_ins_is_corrected_after_a_fix_for_the_surface_time():
    """With a calm sea 15, 30, 45 or 60 s after the fix is heard, each for a quarter of the entities."""
    ins = SimpleINS(**QUIET, sea_state_gps=1.0)
    crowd = Block(name="c", count=200, autonomy=Accelerate(), motion=SingleIntegrator(), sensor=[GPS(), ins])
    sim, corrected = Simulation(Mission(blocks=[crowd], dt=0.5, end=100.0), 1), []
    for _ in range(80):
        before = sim.read("c.SimpleINS.variance")[0][0, :, 1]
        sim.step()
        corrected.append(int((sim.read("c.SimpleINS.variance")[0][0, :, 1] < before).sum()))
    first = np.flatnonzero(corrected)[:2]
    assert first.tolist() == [31, 61]  # waits for more than 15 s, from the second step on
    assert is_share(corrected[31], 0.25, 200)
    rough = Block(
        name="c",
        count=3,
        autonomy=Accelerate(),
        motion=SingleIntegrator(),
        sensor=[GPS(), SimpleINS(**QUIET)],
    )
    sim = after(Mission(blocks=[rough], dt=0.5, end=100.0), 140)
    assert (sim.read("c.SimpleINS.surface_time")[0] >= 75.0).all()


def test_the_attitude_and_velocity_of_an_ins_err():
    zero = {f"pos_noise_{i}": (0.0, 0.0) for i in range(3)} | {
        "orient_noise_0": (0.0, 0.0),
        "orient_noise_1": (0.0, 0.0),
    }
    ins = SimpleINS(**zero, orient_noise_2=(0.2, 0.05), vel_noise_1=(1.0, 2.0))
    sim = after(Mission(blocks=[still("c", count=1000, sensor=ins)]))
    _, north, _ = sim.read("c.SimpleINS.belief_vel")[0][0].T
    assert is_spread(north, 2.0)
    quat = sim.read("c.SimpleINS.belief_quat")[0][0].T
    yaw = 2.0 * np.arctan2(quat[3], quat[0])
    assert is_spread(yaw, 0.05)
    assert abs(yaw.mean() - 0.2) < 5.0 * 0.05 / math.sqrt(1000)


# Range -----------------------------------------------------------------------------------------------------------

EXACT = {
    "range_sd_min": 0.0,
    "range_sd_per_unit": 0.0,
    "probability_of_error": 0.0,
    "probability_oor_error": 0.0,
    "max_range": 100.0,
}


def ranges(sensor, scene=None, steps=1, count=1, pos=(0.0, 0.0, 20.0), **settings):
    mission = Mission(
        blocks=[still("a", pos, count=count, sensor=sensor)], scene=scene or Scene(), **settings
    )
    sim = after(mission, steps)
    return [sim.read(f"a.LOSSensor.{name}")[0][0] for name in ("los_range", "los_sd", "is_in_range")]


def test_a_line_of_sight_has_the_length_of_height_over_sine():
    down = LOSSensor(**EXACT, rpy="0 30 0", xyz=(3.0, 0.0, 0.5))
    distance, _, is_in = ranges(down)
    assert (distance[0], is_in[0]) == (pytest.approx(41.0, abs=1e-12), 1.0)
    for lost, told in (
        (down.replace(rpy="0 -30 0"), math.inf),
        (down.replace(max_range=40.9), math.inf),
        (down.replace(max_range=40.9, oor_return=150.0), 150.0),
        (down.replace(min_range=41.1), -math.inf),
    ):
        distance, sd, is_in = ranges(lost)
        assert (distance[0], sd[0], is_in[0]) == (told, 10.0, 0.0)
        distance, sd, is_in = ranges(lost.replace(oor_return=150.0), compat="scrimmage")
        assert (distance[0], sd[0], is_in[0]) == (150.0, 10.0, 0.0)
    scene = Scene(
        ground=FlatGround(-5.0), walls=(Cuboid(center=(20.0, 0.0, 0.0), lengths=(2.0, 50.0, 50.0)),)
    )
    ahead = down.replace(rpy=(0.0, 0.0, 0.0), use_flat_earth=False)
    assert ranges(ahead, scene)[0][0] == pytest.approx(16.0)
    assert ranges(down.replace(rpy="0 90 0", use_flat_earth=False), scene)[0][0] == pytest.approx(25.5)


def test_a_line_of_sight_errs():
    down = LOSSensor(**{**EXACT, "range_sd_min": 0.1, "range_sd_per_unit": 0.02}, rpy="0 90 0")
    distance, sd, _ = ranges(down, count=1000)
    assert is_spread(distance, 0.5)
    assert sd == pytest.approx(0.5)
    wild = LOSSensor(**{**EXACT, "probability_of_error": 0.3}, rpy="0 90 0", error_sd=2.0)
    distance, _, _ = ranges(wild, count=1000)
    errors = distance[distance != 20.0]
    assert is_share(len(errors), 0.3, 1000)
    assert is_spread(errors, 2.0)
    confused = LOSSensor(**{**EXACT, "probability_oor_error": 0.2}, rpy="0 90 0")
    assert is_share(np.isinf(ranges(confused, count=1000)[0]).sum(), 0.2, 1000)
    distance, _, _ = ranges(confused.replace(rpy="0 0 0"), count=1000)
    assert is_share((distance == 100.0).sum(), 0.2, 1000)


def test_a_mission_file_gives_angles_in_degrees_and_the_historic_names(tmp_path):
    (tmp_path / "m.xml").write_text(
        """<runscript><run start="0" end="1" dt="0.1"/><entity><team_id>1</team_id><count>1</count><motion_model>Still</motion_model>
        <sensor rpy="0, 0, 45" azimuth_fov="60" show_image="true" camera_id="1" frames_per_second="20">ContactBlobCamera</sensor>
        <sensor use_flat_earth_="false" rpy="0, 90, 0" sensor_id="2">LOSSensor</sensor></entity></runscript>"""
    )
    loaded = read_mission(tmp_path / "m.xml")
    camera, laser = loaded.mission.blocks[0].sensor
    assert (camera.azimuth_fov, camera.rpy[2]) == pytest.approx((math.pi / 3.0, math.pi / 4.0))
    assert (laser.use_flat_earth, laser.rpy[1]) == (False, math.pi / 2.0)
    assert (
        sum("has no effect" in str(note) for note in loaded.notes) == 3
    )  # camera_id, frames_per_second, sensor_id
