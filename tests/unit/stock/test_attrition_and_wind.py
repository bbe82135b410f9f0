"""Random losses, and forces of the air, against closed forms."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from small_worlds import Drift, block, mission

from tussle import Simulation
from tussle.numeric import dryden
from tussle.stock import Ballistic, ExternalForceField, RandomAttrit, Still


def test_a_team_shrinks_linearly_to_those_that_are_left_alive():
    game = mission(
        block("a", team=1, count=40), block("b", team=2, count=3),
        interactions=[RandomAttrit(start_after=1.0, duration=2.0, leave_alive=(3, 7, 7))], end=4.0,
    )  # fmt: skip
    sim = Simulation(game, seeds=[1, 2], on_error="raise")
    for step in range(1, 41):
        sim.step()
        left = 40 if step < 10 else math.ceil(40 * max(0.0, 1.0 - (step - 10) / 20) - 1e-6)
        alive = sim.read("a.pos")[1]
        assert alive.sum(axis=1).tolist() == [max(2, left)] * 2, step
    assert np.flatnonzero(alive[0]).tolist() == [2, 6]
    assert sim.read("b.pos")[1].all()


def test_a_team_that_appears_late_is_not_lost_at_once():
    late = block("late", team=1, count=10, first_birth=1.0)
    rule = RandomAttrit(start_after=0.0, duration=4.0, leave_alive=())
    sim = Simulation(mission(late, interactions=[rule], end=3.0, end_conditions="time"))
    for steps, left in ((11, 8), (9, 5), (10, 3)):  # ceil(10 (1 - t / 4))
        sim.step(steps)
        assert sim.read("late.pos")[1].sum() == left


def test_all_are_equally_likely_to_be_lost():
    game = mission(
        block(team=1, count=10),
        interactions=[RandomAttrit(start_after=0.0, duration=0.2, leave_alive=())],
        end=0.1,
    )
    sim = Simulation(game, seeds=range(400))
    sim.run()
    alive = sim.read("a.pos")[1]
    assert (alive.sum(axis=1) == 5).all()
    assert abs(alive.sum(axis=0) - 200).max() < 4 * math.sqrt(400 * 0.25)  # four standard deviations


RESTS = {"autonomy": (), "motion": Still(), "position": (0.0, 0.0, 30.0)}


def test_a_constant_force_and_moments_near_the_ground():
    wind = ExternalForceField(
        constant_force=(1.0, 2.0, 3.0), moment_roll_amplitude=4.0, moment_roll_period=0.4,
        moment_pitch_amplitude=5.0, moment_pitch_period=0.4, moment_enable_max_z=20.0,
    )  # fmt: skip
    low = block("low", heading="90 deg", **RESTS | {"position": (0.0, 0.0, 10.0)})
    sim = Simulation(mission(block("high", **RESTS), low, interactions=[wind]))
    sim.step()  # a quarter of a period
    for name, torque in (("high", (0.0, 0.0, 0.0)), ("low", (-5.0, 4.0, 0.0))):
        assert sim.read(f"{name}.force")[0][0, 0].tolist() == [1.0, 2.0, 3.0]
        assert sim.read(f"{name}.torque")[0][0, 0] == pytest.approx(torque, abs=1e-12)


def test_a_constant_force_accelerates_a_mass():
    wind = ExternalForceField(constant_force=(3.0, 0.0, 2.0 * 9.81))
    ball = block(autonomy=(), motion=Ballistic(), mass=2.0)
    sim = Simulation(mission(ball, interactions=[wind]))
    sim.step(10)
    # The force is there from the end of the first step on; gravity from the beginning.
    assert sim.read("a.pos")[0][0, 0] == pytest.approx([0.5 * 1.5 * 0.9**2, 0.0, -9.81 * (0.005 + 0.09)])


def test_a_variable_force_is_the_same_for_all_and_changes_after_a_while():
    wind = ExternalForceField(
        force_type="variable", variable_force_0=(10.0, 5.0), force_change_period=(0.45, 0.0)
    )
    sim = Simulation(mission(block(count=2, **RESTS), interactions=[wind]), seeds=range(400))
    seen = []
    for _ in range(7):
        sim.step()
        forces = sim.read("a.force")[0]
        assert (forces[:, 0] == forces[:, 1]).all()
        seen.append(forces[:, 0])
    changes = [bool((a != b).all()) for a, b in itertools.pairwise(seen)]
    assert changes == [False] * 4 + [True, False]  # drawn at 0.1 s; due at 0.55 s, so at 0.6 s
    for component, (mean, sd) in enumerate(((10.0, 5.0), (0.0, 5.0), (0.0, 1.0))):
        values = seen[0][:, component]
        assert abs(values.mean() - mean) < 4 * sd / 20
        assert abs(values.std() / sd - 1.0) < 4 / math.sqrt(800)


@pytest.mark.parametrize("h", [0.02, 0.5, 1.5])
def test_gusts_have_the_correlations_of_dryden(h):
    """Longitudinal exp(-x), transverse exp(-x) (1 - x / 2), over x length scales, after one step and after two."""
    n = 40_000
    draws = np.random.default_rng(1).standard_normal((3, 5, n))
    states = [dryden.at_start(draws[0])]
    for draw in draws[1:]:
        states.append(dryden.passed(states[-1], np.full(n, h), np.full(n, h), draw))
    gusts = [dryden.gust(s) for s in states]
    for k, now in enumerate(gusts):
        x = k * h
        expected = [math.exp(-x), *[math.exp(-x) * (1.0 - 0.5 * x)] * 2]
        measured = (gusts[0] * now).mean(axis=1)
        assert measured == pytest.approx(expected, abs=4 * math.sqrt(2 / n))
        assert (now * now).mean(axis=1) == pytest.approx([1.0] * 3, abs=4 * math.sqrt(2 / n))


def test_scales_and_intensities_of_the_military_specification():
    heights = dryden.FOOT * np.array([1.0, 10.0, 100.0, 1000.0, 5000.0])
    scale, sd = dryden.low_altitude(heights, np.full(5, 7.7)).reshape(2, 2, 5)
    for i, h in enumerate((10.0, 10.0, 100.0, 1000.0, 1000.0)):
        base = 0.177 + 0.000823 * h
        assert scale[:, i] / dryden.FOOT == pytest.approx([h / base**1.2, h], rel=1e-12)
        assert sd[:, i] == pytest.approx([0.77 / base**0.4, 0.77], rel=1e-12)
    assert scale[:, 3] == pytest.approx([304.8, 304.8])


def test_the_force_of_gusts_is_drawn_for_each_entity_along_the_wind():
    wind = ExternalForceField(force_type="dryden", drag=2.0, wind_heading="90 deg")
    crowd = block(count=3000, **RESTS)
    sim = Simulation(mission(crowd, interactions=[wind]))
    sim.step()
    first = sim.read("a.force")[0][0].T
    sim.step()
    second = sim.read("a.force")[0][0].T
    scale, sd = dryden.low_altitude(np.array([30.0]), np.array([7.7])).reshape(2, 2, 1)
    expected = 2.0 * np.array([sd[0, 0], sd[0, 0], sd[1, 0]])
    assert first.std(axis=1) == pytest.approx(expected, rel=4 / math.sqrt(2 * 3000))
    x = 0.1 * 7.7 / scale[:, 0]  # the wind carries the gusts past those at rest
    along, across = math.exp(-x[0]), math.exp(-x[0]) * (1.0 - 0.5 * x[0])
    correlation = (first * second).mean(axis=1) / (first.std(axis=1) * second.std(axis=1))
    # A correlation r of n samples has the standard error (1 - r^2) / sqrt(n), and the mean is not exactly 0.
    assert correlation[1] == pytest.approx(along, abs=4 * (1 - along**2) / math.sqrt(3000))
    assert correlation[0] == pytest.approx(across, abs=4 * (1 - across**2) / math.sqrt(3000))


def test_without_wind_there_are_no_gusts():
    calm = ExternalForceField(force_type="dryden", wind_speed=0.0)
    sim = Simulation(mission(block(count=3, autonomy=Drift(to=(0, 0, 0))), interactions=[calm]))
    sim.run()
    assert not sim.read("a.force")[0].any()
