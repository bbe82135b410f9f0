"""Captures, collisions, regions and their metrics by the laws of SCRIMMAGE, in small games computed by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from small_worlds import Drift, Reaper, block, mission

from tussle import Simulation
from tussle.api import Autonomy, Metric, Output, Param, Publish, State
from tussle.messages import BoundaryShape, CaptureEntity, EntityCaptured, FlagTaken
from tussle.plugins import historic, stock


class Claimer(Autonomy):
    """Stand still and claim an entity in one step."""

    target = Param(1)
    at = Param(0)
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")
    claims = Publish(CaptureEntity)

    def step(self, g):
        rows = np.flatnonzero(g.step_count == self.at)
        self.claims.publish(rows, target=self.target[rows])


class Heard(Metric):
    """Step, sender's id and number of the captures, flags and shapes that the world told of."""

    captured = State("step who n", dtype=int, per="world")
    taken = State("step who n", dtype=int, per="world")
    shown = State("step who n", dtype=int, per="world")

    def step(self, w):
        for state, event, who in (
            (self.captured, EntityCaptured, "source"), (self.taken, FlagTaken, "entity"), (self.shown, BoundaryShape, "boundary"),
        ):  # fmt: skip
            told = w.inbox(event)
            state[0, told.world] = w.step_count[told.world]
            state[1, told.world] = getattr(told, who)
            np.add.at(state[2], told.world, 1)


def moving(name, to=(0, 0, 0), **values):
    return block(name, **{"team": 1, "autonomy": Drift(to=to), **values})


def heard(sim, name):
    return sim.read(f"Heard.{name}")[0].ravel().tolist()


def is_there(sim, name):
    return bool(sim.read(f"{name}.pos")[1].any())


# -- captures -------------------------------------------------------------------------------------------------------------


def hunt(*claimers, speed=0.0, **values):
    """Entity 1 is the prey at the origin; claimers are (distance, step of the claim)."""
    hunters = [
        block(f"h{i}", team=2 + i, position=(0, far, 0), autonomy=Claimer(at=at))
        for i, (far, at) in enumerate(claimers)
    ]
    prey = moving("prey", (0, -speed, 0), team=1)
    return Simulation(
        mission(prey, *hunters, interactions=[historic.SimpleCapture(**values)], metrics=[Heard()]), seeds=1
    )


def test_a_capture_is_decided_one_step_late_and_the_claims_of_the_last_step_are_lost():
    sim = hunt((4.0, 3))
    sim.step(4)
    assert is_there(sim, "prey")
    sim.step()
    assert not is_there(sim, "prey")
    assert heard(sim, "captured") == [4, 2, 1]
    late = hunt((4.0, 9))
    late.run()
    assert is_there(late, "prey")


def test_after_a_claim_that_is_out_of_range_when_decided_nobody_can_capture_the_prey():
    """4 m away, 1 m/step: 5 m at the end of step 0 and 6 m at that of step 1, where the claim of step 0 is decided."""
    fled = hunt((4.0, 0), (-5.0, 1), (-5.0, 2), speed=10.0)
    fled.run()
    assert is_there(fled, "prey")
    caught = hunt((-5.0, 1), (-5.0, 2), speed=10.0)
    caught.run()
    assert heard(caught, "captured") == [2, 2, 1]


def test_of_two_claims_the_smaller_id_decides_though_the_other_is_nearer():
    sim = hunt((4.0, 0), (1.0, 0))
    sim.run()
    assert heard(sim, "captured") == [1, 2, 1]
    missed = hunt((6.0, 0), (1.0, 0))
    missed.run()
    assert is_there(missed, "prey")


def test_switches_are_asked_after_the_claim_has_made_the_prey_immune():
    sim = hunt((4.0, 0), (4.0, 5), enable_non_team_captures=False)
    sim.run()
    assert is_there(sim, "prey")


# -- collisions -----------------------------------------------------------------------------------------------------------


def test_of_three_that_meet_the_first_pair_collides_and_the_third_flies_on():
    meet = [moving(n, to, position=at) for n, to, at in (
        ("a", (10, 0, 0), (-2.45, 0, 0)), ("b", (-10, 0, 0), (2.45, 0, 0)), ("c", (0, -10, 0), (0, 2.45, 0)))]  # fmt: skip
    for plugin, left in (
        (historic.SimpleCollision(), [False, False, True]),
        (stock.SimpleCollision(), [False] * 3),
    ):
        sim = Simulation(mission(*meet, interactions=[plugin]), seeds=1)
        sim.run()
        assert [is_there(sim, n) for n in "abc"] == left


def test_those_removed_earlier_in_the_step_do_not_collide():
    pair = [moving("a", team=1), moving("b", team=2, position=(3, 0, 0), to=(-10, 0, 0))]
    removes_a = Reaper(team=1, at=0.2)  # the step in which b comes within 2 m
    for order, left in (
        ([removes_a, historic.SimpleCollision()], True),
        ([historic.SimpleCollision(), removes_a], False),
    ):
        sim = Simulation(mission(*pair, interactions=order), seeds=1)
        sim.run()
        assert is_there(sim, "b") is left


def test_altitudes_at_the_range_itself_are_rejected_at_the_start():
    def rejects(plugin):
        sim = Simulation(mission(moving("a"), interactions=[plugin]), seeds=1)
        bound = sim.state.interactions[0]
        return bound.plugin.rejects(bound.view, 0, np.zeros(3), np.array([[50.0], [0.0], [2.0]]))

    assert rejects(historic.SimpleCollision(init_alt_deconflict=True))
    assert not rejects(stock.SimpleCollision(init_alt_deconflict=True))
    assert not rejects(historic.SimpleCollision())


def test_flight_times_end_a_step_early_and_those_of_survivors_at_the_last_removal():
    """Three meet in step 19 of 100, a fourth is far away: 2 x 1.9 s for each team of two, as a run of SCRIMMAGE had it."""
    meet = [moving(n, to, team=team, position=at) for n, to, at, team in (
        ("a", (10, 0, 0), (-20.95, 0, 0), 1), ("b", (-10, 0, 0), (20.95, 0, 0), 1), ("c", (0, -10, 0), (0, 20.95, 0), 2),
        ("d", (0, 0, 0), (900, 0, 0), 2))]  # fmt: skip
    rules = {
        "interactions": [historic.SimpleCollision()],
        "metrics": [historic.SimpleCollisionMetrics(flight_time_w=1.0)],
    }
    found = Simulation(mission(*meet, end=10.0, **rules), seeds=1).run()[0].metrics["SimpleCollisionMetrics"]
    assert found["flight_time"] == pytest.approx({1: 3.8, 2: 3.8})
    assert found["flight_time_norm"] == pytest.approx({1: 2.0, 2: 2.0})
    assert found["team_coll"] == {1: 2, 2: 0}
    assert found["score"] == pytest.approx({1: 0.0, 2: 2.0})
    calm = Simulation(mission(*meet[:1], meet[3], end=10.0, **rules), seeds=1).run()[0]
    assert calm.metrics["SimpleCollisionMetrics"]["flight_time"] == pytest.approx({1: 9.9, 2: 9.9})


def test_those_removed_in_their_first_step_fly_to_the_last_removal_and_a_late_team_scores_nan():
    early = [
        moving("a", (20, 0, 0), position=(-2.9, 0, 0)),
        moving("b", (-20, 0, 0), position=(2.9, 0, 0)),
        moving("c", position=(9, 0, 0), team=2),
    ]
    late = moving("late", team=3, position=(50, 0, 0), count=1, rate=1.0, first_birth=0.5)
    rules = {
        "interactions": [historic.SimpleCollision(), Reaper(team=2, at=0.8)],
        "metrics": [historic.SimpleCollisionMetrics(flight_time_w=1.0)],
    }
    found = Simulation(mission(*early, late, **rules), seeds=1).run()[0].metrics["SimpleCollisionMetrics"]
    assert found["flight_time"] == pytest.approx({1: 1.4, 2: 0.7, 3: 0.2})
    assert found["flight_time_norm"] == pytest.approx({1: 2.0, 2: 1.0, 3: math.inf})
    assert found["entity_count"] == {1: 2, 2: 1, 3: 1}
    assert math.isnan(found["score"][3]) is False  # infinite, as its weight is not 0
    unweighted = mission(
        *early, late, interactions=rules["interactions"], metrics=[historic.SimpleCollisionMetrics()]
    )
    assert math.isnan(Simulation(unweighted, seeds=1).run()[0].scores[3])


def test_the_ground_is_told_of_in_every_step():
    down = moving("a", position=(0, 0, 0.25), to=(0, 0, -1))
    for law, steps in ((historic, 8), (stock, 1)):
        rules = {
            "interactions": [law.GroundCollision(remove_on_collision=False)],
            "metrics": [law.SimpleCollisionMetrics()],
        }
        found = Simulation(mission(down, **rules), seeds=1).run()[0].metrics["SimpleCollisionMetrics"]
        assert found["ground_coll"] == {1: steps}


# -- regions --------------------------------------------------------------------------------------------------------------


def ball(law, number, x, radius=5.0, team=1):
    return law.Boundary(
        name=f"b{number}", boundary_id=number, team=team, shape="sphere", center=(x, 0, 0), radius=radius
    )


def test_a_boundary_is_not_turned_and_tells_of_itself_in_the_first_step_only():
    turned = historic.Boundary(lengths=(20, 2, 2), rpy=(0, 0, math.pi / 2))
    assert turned.region().contains(np.array([[9.0, 0.0], [0.0, 9.0], [0.0, 0.0]])).tolist() == [True, False]
    assert historic.Boundary(shape="sphere").region() == stock.Boundary(shape="sphere").region()
    late = moving("late", count=1, rate=1.0, first_birth=0.5)
    for law, told in ((historic, 0), (stock, 1)):
        sim = Simulation(mission(late, interactions=[law.Boundary()], metrics=[Heard()]), seeds=1)
        sim.run()
        assert heard(sim, "shown")[2] == told


def test_boundaries_are_enforced_from_the_second_step_on_and_unknown_ids_ignored():
    outside = moving("out", position=(9, 0, 0))
    rules = [ball(historic, 1, 0.0), historic.EnforceBoundaryInteraction(active_boundary_ids=(1, 77))]
    sim = Simulation(mission(outside, moving("in"), interactions=rules), seeds=1)
    sim.step()
    assert is_there(sim, "out")
    sim.step()
    assert not is_there(sim, "out")
    sim.run()
    assert is_there(sim, "in")
    free = Simulation(mission(outside, interactions=[historic.EnforceBoundaryInteraction()]), seeds=1)
    free.run()
    assert is_there(free, "out")


def test_defenders_measure_to_where_the_intruder_was_before_the_motion():
    """The intruder comes in at 2 m a step: captured when it was within 5 m before a step, here one step later."""
    for law, step in ((historic, 4), (stock, 3)):
        game = mission(
            moving("home", team=1), moving("in", (-20, 0, 0), team=2, position=(11.5, 0, 0)),
            interactions=[ball(law, 1, 0.0, 20.0), law.CaptureInBoundaryInteraction()], metrics=[Heard()],
        )  # fmt: skip
        sim = Simulation(game, seeds=1)
        sim.run()
        assert heard(sim, "captured") == [step, 1, 1]
    at_once = mission(
        moving("home", team=1), moving("in", team=2, position=(1, 0, 0)),
        interactions=[ball(historic, 1, 0.0), historic.CaptureInBoundaryInteraction()], metrics=[Heard()],
    )  # fmt: skip
    sim = Simulation(at_once, seeds=1)
    sim.run()
    assert heard(sim, "captured") == [1, 1, 1]


def test_all_that_enter_in_a_step_tell_that_they_took_the_flag_and_the_last_one_has_it():
    runners = [moving(n, team=2, position=(x, 0, 0)) for n, x in (("near", 1), ("far", 3))]
    for law, told, carrier in ((historic, [1, 2, 2], 2), (stock, [0, 1, 1], 1)):
        rules = [ball(law, 2, 0.0), ball(law, 1, 99.0, team=2), law.FlagCaptureInteraction()]
        sim = Simulation(mission(*runners, interactions=rules, metrics=[Heard()]), seeds=1)
        sim.run()
        assert heard(sim, "taken") == told
        assert sim.read("FlagCaptureInteraction.carrier")[0].tolist() == [carrier]


# -- losses, forces, other metrics ----------------------------------------------------------------------------------------


def test_attrition_takes_one_entity_per_step_and_begins_a_step_later():
    team = block("a", team=1, count=6, variance=(100, 100, 0))
    rule = historic.RandomAttrit(start_after=0.3, duration=0.1, leave_alive=())
    sim = Simulation(mission(team, interactions=[rule]), seeds=1)
    left = []
    while not sim.is_over:
        sim.step()
        left.append(int(sim.read("a.pos")[1].sum()))
    assert left[:9] == [6, 6, 6, 6, 5, 4, 3, 2, 1]


class Idle(Autonomy):
    """Command nothing."""

    commands = Output("thrust elevator aileron rudder")

    def step(self, g):
        pass


def test_a_force_acts_in_the_first_step_too():
    body = block("a", motion=stock.RigidBody6DOF(), autonomy=Idle(), mass=2.0)
    for law, moved in ((historic, True), (stock, False)):
        field = law.ExternalForceField(constant_force=(0, 6, 0))
        sim = Simulation(mission(body, interactions=[field]), seeds=1)
        sim.step()
        assert bool(sim.read("a.vel")[0].ravel()[1] > 0.0) is moved


def test_captures_of_a_late_team_are_not_counted():
    late = block(
        "late", team=3, position=(0, 1, 0), autonomy=Claimer(at=6), count=1, rate=1.0, first_birth=0.5
    )
    for law, counted in ((historic, 0), (stock, 1)):
        rules = {"interactions": [stock.SimpleCapture()], "metrics": [law.SimpleCaptureMetrics()]}
        result = Simulation(mission(moving("prey"), late, **rules), seeds=1).run()[0]
        assert result.metrics["SimpleCaptureMetrics"]["NonTeamCapture"][3] == counted
        assert result.scores[3] == counted


def test_the_closest_approach_is_at_the_start_of_its_step():
    pair = [moving("a", (10, 0, 0), team=1), moving("b", team=2, position=(3.2, 1, 0))]
    for law, when in ((historic, 0.2), (stock, 0.3)):
        found = Simulation(mission(*pair, metrics=[law.CPA()]), seeds=1).run()[0].metrics["CPA"]
        assert found["cpa_time"] == pytest.approx({1: when, 2: when})
