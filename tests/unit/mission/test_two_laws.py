"""Parameters that do what their names say, and with compat="scrimmage" what they do there."""

from __future__ import annotations

import numpy as np
import pytest
from small_worlds import Drift, block, mission

from tussle import Simulation
from tussle.mission import read_mission
from tussle.stock import (
    Boids,
    Boundary,
    BoundaryDefense,
    CaptureInBoundaryInteraction,
    RayTrace,
    SingleIntegrator,
)

MISSION = """<runscript{compat}>
  <run end="1" dt="0.1"/>
  <entity><name>r</name> <count>1</count> <autonomy{of}>{autonomy}</autonomy>{more}
    <motion_model max_speed="20">SingleIntegrator</motion_model></entity>
</runscript>"""


@pytest.fixture
def read(tmp_path):
    def read(*, compat="", **words):
        file = tmp_path / "m.xml"
        file.write_text(
            MISSION.format(
                compat=f' compat="{compat}"' if compat else "",
                **{"of": "", "more": "", "autonomy": "", **words},
            )
        )
        return read_mission(file).mission

    return read


def speed_after_a_step(game) -> float:
    simulation = Simulation(game)
    simulation.step()
    return float(np.linalg.norm(simulation.read("r.vel")[0]))


@pytest.mark.parametrize(("asked", "flown"), [(3.0, 3.0), (20.0, 20.0), (1e4, 20.0), (0.0, 0.0)])
def test_max_speed_is_a_limit_and_with_compat_the_speed_of_every_command(asked, flown):
    points = block(
        "r",
        count=1,
        autonomy=Drift(to=(0.6 * asked, 0, 0.8 * asked)),
        motion=SingleIntegrator(max_speed=20.0),
    )
    assert speed_after_a_step(mission(points)) == pytest.approx(flown)
    assert speed_after_a_step(mission(points, compat="scrimmage")) == pytest.approx(20.0 if asked else 0.0)


@pytest.mark.parametrize(("compat", "flown"), [("", 3.0), ("scrimmage", 20.0)])
def test_a_file_chooses_its_law_too(read, compat, flown):
    game = read(compat=compat, of=' waypoints="[900 0 0]" speed="3"', autonomy="GoTo")
    assert speed_after_a_step(game) == pytest.approx(flown)


def test_boids_fly_at_max_speed_and_with_compat_at_half_of_it():
    pair = block(
        "r", count=2, variance=(1.0, 1.0, 1.0), autonomy=Boids(max_speed=20.0), motion=SingleIntegrator()
    )
    alone = block("r", count=1, autonomy=Boids(max_speed=20.0), motion=SingleIntegrator())
    for flock in (pair, alone):
        simulation = Simulation(mission(flock))
        simulation.step()
        assert np.linalg.norm(simulation.read("r.vel")[0], axis=-1) == pytest.approx(20.0)
    assert speed_after_a_step(mission(alone, compat="scrimmage")) == pytest.approx(1.0)
    simulation = Simulation(mission(pair, compat="scrimmage"))
    simulation.step()
    assert np.linalg.norm(simulation.read("r.vel")[0], axis=-1) == pytest.approx(10.0)


def test_a_defender_keeps_up_with_an_intruder_that_flees():
    """The intruder flies away at 12 m/s: a defender of 15 m/s comes within 5 m of it, if it does not slow down behind it."""
    home = Boundary(name="home", boundary_id=1, team=1, shape="sphere", radius=900.0)
    rules = [home, CaptureInBoundaryInteraction(boundary_id=1, capture_range=5.0)]
    defender = block(
        "d", count=1, team=1, autonomy=BoundaryDefense(), motion=SingleIntegrator(max_speed=15.0)
    )
    raider = block("r", count=1, team=2, position=(60.0, 0, 0), autonomy=Drift(to=(12.0, 0, 0)))
    for compat in ("", "scrimmage"):
        simulation = Simulation(mission(defender, raider, interactions=rules, end=40.0, compat=compat))
        while not simulation.is_over and simulation.read("r.pos")[1].all():
            simulation.step()
        assert simulation.t[0] == pytest.approx(18.4, abs=0.15)  # 55 m at 3 m/s


def test_the_period_of_a_lidar_by_both_names(read):
    for name in ("max_sample_rate", "scan_period"):
        game = read(autonomy="Straight", more=f'<sensor {name}="250 ms">RayTrace</sensor>')
        assert game.blocks[0].sensor == (RayTrace(scan_period=0.25),)
