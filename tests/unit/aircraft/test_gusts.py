"""Gusts at compiled aircraft: their spectra, and what they do."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tussle import Block, Mission, Simulation
from tussle.numeric.dryden import any_altitude
from tussle.plugins.stock.motion.jsbsim_compiled.flying import FOOT, GUSTS, SLOTS
from tussle.plugins.stock.motion.jsbsim_compiled.plugin import GUST
from tussle.stock import AircraftPIDController, JSBSimCompiled, Straight, examples

HAWK = str(examples()["JSBSimModel"].with_name("hawk"))
SPEED = 24.0


def hawks(n: int, z: float, **own) -> Simulation:
    """Hawks that fly to the east."""
    block = Block(
        name="hawk", count=n, position=(0, 0, z), speed=SPEED, autonomy=Straight(speed=SPEED), controller=AircraftPIDController(),
        motion=JSBSimCompiled(jsbsim_root=HAWK, aircraft="hawk", **own),
    )  # fmt: skip
    return Simulation(
        Mission(blocks=[block], dt=0.1, motion_multiplier=12, end=60.0), seeds=3, on_error="raise"
    )


def gusts_of(sim: Simulation) -> np.ndarray:
    """Gusts north, east, down [m/s], (3, n)."""
    (group,) = sim.state.population.groups
    slots = group.motion.plugin.flown.aircraft.slots
    return FOOT * group.x[[SLOTS + slots[name] for name in GUST]]


@pytest.mark.parametrize("z", [60.0, 450.0, 1500.0])
@pytest.mark.slow
def test_gusts_have_the_variances_and_correlations_of_the_specification(z):
    n, steps = 3000, 30
    sim = hawks(n, z, gusts="dryden", gust_wind_speed=10.0, gust_deviation=1.2)
    sim.step()
    before, start = gusts_of(sim), sim.read("hawk.pos")[0][0]
    sim.step(steps)
    after, end = gusts_of(sim), sim.read("hawk.pos")[0][0]
    for now, place in ((before, start), (after, end)):
        *_, sd_uv, sd_w = any_altitude(place[:, 2].mean(), 10.0, 1.2)
        assert now.std(axis=1) == pytest.approx([sd_uv, sd_uv, sd_w], rel=4 / math.sqrt(2 * n) + 0.01)
    scale_uv, scale_w, *_ = any_altitude(0.5 * (start + end)[:, 2].mean(), 10.0, 1.2)
    path = np.linalg.norm(end - start, axis=1).mean()
    correlation = (before * after).mean(axis=1) / (before.std(axis=1) * after.std(axis=1))
    along, across, up = path / scale_uv, path / scale_uv, path / scale_w
    expected = np.array(
        [math.exp(-across) * (1.0 - 0.5 * across), math.exp(-along), math.exp(-up) * (1.0 - 0.5 * up)]
    )
    assert (np.abs(correlation - expected) < 4 * (1 - expected**2) / math.sqrt(n) + 0.01).all()


def test_scales_and_deviations_change_linearly_between_a_thousand_and_two_thousand_feet():
    heights = FOOT * np.array([500.0, 1000.0, 1500.0, 2000.0, 9000.0])
    found = any_altitude(heights, np.full(5, 10.0), np.full(5, 3.0))
    high = [1750.0 * FOOT, 1750.0 * FOOT, 3.0, 3.0]
    assert found[:, 3] == pytest.approx(high)
    assert found[:, 4] == pytest.approx(high)
    assert found[:, 2] == pytest.approx(0.5 * (found[:, 1] + high))
    assert found[:, 0] == pytest.approx([FOOT * 500 / 0.5885**1.2, FOOT * 500, 1.0 / 0.5885**0.4, 1.0])


def test_gusts_move_each_aircraft_in_its_own_way_and_weak_ones_change_no_bit():
    calm, still, gusty = (
        hawks(5, 100.0, **own)
        for own in (
            {},
            {"gusts": "dryden", "gust_wind_speed": 0.0, "gust_deviation": 0.0},
            {"gusts": "dryden"},
        )
    )
    for sim in (calm, still, gusty):
        sim.step(20)
    flights = [sim.read("hawk.pos")[0] for sim in (calm, still, gusty)]
    assert flights[0].tobytes() == flights[1].tobytes()
    moved = (flights[2] - flights[0])[0]
    assert (np.abs(np.diff(moved, axis=0)) > 1e-3).all()


def test_a_snapshot_of_aircraft_in_gusts_flies_on_as_they_did():
    sim = hawks(3, 100.0, gusts="dryden")
    sim.step(4)
    kept = sim.snapshot()
    sim.step(6)
    (group,) = sim.state.population.groups
    there = group.x.copy()
    assert gusts_of(sim).all()
    sim.restore(kept)
    sim.step(6)
    (group,) = sim.state.population.groups
    assert (group.x == there).all()
    assert (group.x[-GUSTS + 6] == 120.0).all()  # draws: one set in each substep
