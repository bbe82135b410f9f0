"""The referee of captures and the metric that counts them, by small cases computed by hand."""

from __future__ import annotations

import numpy as np
import pytest
from small_worlds import Drift, block, mission

from tussle import Simulation
from tussle.api import Autonomy, Metric, Output, Param, Publish, State
from tussle.errors import ParameterError
from tussle.messages import CaptureEntity, EntityCaptured
from tussle.stock import SimpleCapture, SimpleCaptureMetrics


class Claimer(Autonomy):
    """Stand still and claim one entity in the steps [first, last)."""

    target = Param(1)
    first = Param(0)
    last = Param(1)
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")
    claims = Publish(CaptureEntity)

    def step(self, g):
        rows = np.flatnonzero((g.step_count >= self.first) & (g.step_count < self.last))
        self.claims.publish(rows, target=self.target[rows])


class Credits(Metric):
    """Who captured whom, as told."""

    source = State(dtype=int, per="world")
    n = State(dtype=int, per="world")

    def step(self, w):
        told = w.inbox(EntityCaptured)
        self.source[told.world] = told.source
        np.add.at(self.n, told.world, 1)


def hunt(*claimers, prey=(0.0, 0.0, 0.0), speed=0.0, **referee):
    """Entity 1 of team 1 is the prey; then the claimers, (distance, team, values)."""
    hunters = [
        block(f"h{i}", team=team, position=(0.0, distance, 0.0), autonomy=Claimer(**values))
        for i, (distance, team, values) in enumerate(claimers)
    ]
    return mission(
        block("prey", team=1, position=prey, autonomy=Drift(to=(speed, 0, 0))),
        *hunters,
        interactions=[SimpleCapture(**referee)],
        metrics=[SimpleCaptureMetrics(), Credits()],
    )


def judged(game, seed=1):
    sim = Simulation(game, seeds=seed)
    sim.run()
    return sim


def alive(sim):
    return bool(sim.read("prey.pos")[1][0, 0])


@pytest.mark.parametrize(("distance", "is_caught"), [(4.0, True), (5.0, True), (5.000001, False)])
def test_a_claim_holds_up_to_the_range_included(distance, is_caught):
    sim = judged(hunt((distance, 2, {})))
    assert alive(sim) is not is_caught


def test_it_is_judged_in_the_same_step_by_the_least_distance_of_the_ways_or_at_their_end():
    sim = Simulation(hunt((4.0, 2, {"first": 0})))
    sim.step()
    assert not alive(sim)
    # 4.9 m before the step, but 0.1 s * 20 m/s further on after it: out of reach at its end.
    fled = {"speed": 20.0}
    assert not alive(judged(hunt((4.9, 2, {"first": 0}), **fled)))
    assert alive(judged(hunt((4.9, 2, {"first": 0}), **fled, between_steps=False)))


def test_a_claim_that_failed_can_be_made_again():
    """The prey comes by: claimed in each step, it is caught in the one that ends within 5 m."""
    sim = Simulation(hunt((0.0, 2, {"last": 99}), prey=(-10.0, 0.0, 0.0), speed=10.0))
    while alive(sim):
        sim.step()
    assert sim.steps[0] == 5
    assert sim.read("Credits.n")[0].tolist() == [1]


def test_credit_goes_once_to_the_nearest_claimant():
    sim = judged(hunt((3.0, 2, {}), (2.0, 3, {}), (4.0, 4, {})))
    assert sim.result()[0].metrics["SimpleCaptureMetrics"]["NonTeamCapture"] == {1: 0, 2: 0, 3: 1, 4: 0}
    assert sim.read("Credits.source")[0].tolist() == [3]


def test_of_equally_near_claimants_the_smaller_id_is_credited():
    sim = judged(hunt((3.0, 2, {}), (-3.0, 3, {})))
    assert sim.read("Credits.source")[0].tolist() == [2]


def test_with_credit_each_every_claim_that_holds_counts_but_the_prey_goes_once():
    sim = judged(hunt((3.0, 2, {}), (2.0, 3, {}), (6.0, 4, {}), credit="each"))
    assert sim.result()[0].metrics["SimpleCaptureMetrics"]["NonTeamCapture"] == {1: 0, 2: 1, 3: 1, 4: 0}
    assert sim.result()[0].scores == {1: 0.0, 2: 1.0, 3: 1.0, 4: 0.0}
    assert sim.result()[0].alive[1] == 0


def test_team_mates_and_others_are_judged_by_their_own_switch():
    both = [(3.0, 1, {}), (4.0, 2, {})]
    assert judged(hunt(*both)).read("Credits.source")[0].tolist() == [2]
    assert judged(hunt(*both, enable_team_captures=False)).read("Credits.source")[0].tolist() == [3]
    assert alive(judged(hunt(both[1], enable_non_team_captures=False)))
    team = judged(hunt(both[0])).result()[0].metrics["SimpleCaptureMetrics"]
    assert team["TeamCapture"] == {1: 1}
    assert team["NonTeamCapture"] == {1: 0}


def test_claims_on_nobody_are_nothing():
    assert alive(judged(hunt((3.0, 2, {"target": 77, "last": 99}), (3.0, 2, {"target": 0, "last": 99}))))


def test_a_captured_prey_is_not_captured_again():
    sim = judged(hunt((3.0, 2, {"last": 99})))
    assert sim.read("Credits.n")[0].tolist() == [1]


def test_teleport_puts_the_captured_elsewhere_and_it_flies_on_from_there():
    sim = Simulation(
        hunt((3.0, 2, {"first": 2, "last": 3}), speed=1.0, effect="teleport", teleport_to=(100.0, 0.0, 0.0))
    )
    sim.step(3)
    assert sim.read("prey.pos")[0][0, 0].tolist() == [100.0, 0.0, 0.0]
    assert sim.read("prey.SingleIntegrator.x")[0][0, 0, :3].tolist() == [100.0, 0.0, 0.0]
    sim.run()
    assert sim.read("prey.pos")[0][0, 0, 0] == pytest.approx(100.7)
    assert sim.result()[0].metrics["SimpleCaptureMetrics"]["NonTeamCapture"][2] == 1


def test_heal_gives_health():
    game = hunt((3.0, 2, {"last": 1}), effect="heal", healed_health=5.0)
    sim = judged(game)
    assert sim.read("prey.health")[0].tolist() == [[5.0]]
    assert alive(sim)


def test_parameters_differ_by_world():
    sim = Simulation(
        hunt((3.0, 2, {}), effect="teleport"),
        seeds=[1, 2, 3],
        params={
            "SimpleCapture.capture_range": [5.0, 2.0, 5.0],
            "SimpleCapture.teleport_to": [(1.0, 2.0, 3.0), (0, 0, 0), (4.0, 5.0, 6.0)],
        },
    )
    sim.run()
    assert sim.read("prey.pos")[0][:, 0].tolist() == [[1.0, 2.0, 3.0], [0.0, 0.0, 0.0], [4.0, 5.0, 6.0]]


def test_weights_make_the_score():
    game = hunt((3.0, 1, {}), (9.0, 2, {"target": 2, "last": 1}))
    game = game.replace(metrics=[SimpleCaptureMetrics(TeamCapture_weight=-2.0, NonTeamCapture_weight=10.0)])
    result = judged(game).result()[0]
    # Entity 2 claims its mate at 3 m; entity 3, 6 m from entity 2, claims in vain.
    assert result.scores == {1: -2.0, 2: 0.0}
    assert result.winner == 2


def test_counts_are_columns_per_team_and_world():
    sim = Simulation(hunt((3.0, 2, {})), seeds=[1, 2], params={"SimpleCapture.capture_range": [5.0, 1.0]})
    sim.run()
    assert sim.read("SimpleCaptureMetrics.non_team_captures")[0].tolist() == [[0, 1], [0, 0]]


def test_choices_are_told():
    with pytest.raises(ParameterError, match=r"SimpleCapture.credit = 'twice' is not allowed"):
        SimpleCapture(credit="twice")
    with pytest.raises(ParameterError, match="one of 'remove', 'teleport', 'heal'"):
        SimpleCapture(effect="explode")
