"""The ground, collisions counted, and the closest approach."""

from __future__ import annotations

import math

import numpy as np
import pytest
from small_worlds import Drift, Reaper, block, mission

from tussle import Simulation
from tussle.api import Metric, MotionModel, State
from tussle.errors import MissionError, ParameterError
from tussle.messages import EntityHitGround
from tussle.scene import Origin, Scene
from tussle.stock import CPA, GroundCollision, SimpleCollision, SimpleCollisionMetrics


class GroundNotes(Metric):
    """Counts what is said of the ground."""

    n = State(dtype=int, per="world")

    def step(self, w):
        said = w.inbox(EntityHitGround)
        np.add.at(self.n, said.world, 1)

    def result(self, w):
        return {"n": self.n}


def falling(z=10.0, name="a", **values):
    return block(name, position=(0.0, 0.0, z), autonomy=Drift(to=(0.0, 0.0, -10.0)), **values)


def ground(blocks=None, end=1.5, scene=None, **values):
    game = mission(
        *(blocks or [falling()]), interactions=[GroundCollision(**values)], metrics=[GroundNotes(), SimpleCollisionMetrics()],
        end=end, scene=scene or Scene(),
    )  # fmt: skip
    return Simulation(game)


def test_what_comes_down_to_the_ground_is_gone():
    sim = ground()
    sim.step(9)
    assert sim.read("a.pos")[1].all()
    sim.step()
    assert not sim.read("a.pos")[1].any()
    counted = sim.result()[0].metrics
    assert counted["GroundNotes"]["n"] == 1
    assert counted["SimpleCollisionMetrics"]["ground_coll"] == {0: 1}
    assert counted["SimpleCollisionMetrics"]["score"] == {0: 0.0}


@pytest.mark.parametrize(
    "level",
    [{"ground_collision_z": 5.0}, {"ground_collision_altitude": "305 m", "ground_collision_z": -99.0}],
)
def test_the_level_of_the_ground_is_a_height_or_an_altitude(level):
    sim = ground(scene=Scene(origin=Origin(altitude=300.0)), **level)
    sim.step(4)
    assert sim.read("a.pos")[1].all()
    sim.step()
    assert not sim.read("a.pos")[1].any()


def test_the_ground_may_be_there_for_one_team_only():
    sim = ground([falling(name="a", team=1), falling(name="b", team=2)], team="2")
    sim.step(12)
    assert sim.read("a.pos")[1].all()
    assert not sim.read("b.pos")[1].any()


def test_a_team_that_is_no_number_is_refused():
    with pytest.raises(ParameterError, match=r"GroundCollision\.team = 'blue' is not allowed"):
        ground(team="blue")


class Brick(MotionModel):
    """Falls."""

    x = State("z rate", unit="m m/s")

    @staticmethod
    def derivative(rate, force_z, mass):
        return rate, force_z / mass - 9.81

    def from_body(self, body, rows):
        self.x[0, rows], self.x[1, rows] = body.pos[2, rows], body.vel[2, rows]

    def to_body(self, body):
        body.pos[2], body.vel[2] = self.x[0], self.x[1]


def test_what_is_carried_bears_its_own_weight_and_is_told_once():
    brick = block(
        position=(0.0, 0.0, 0.01), velocity=(0.0, 0.0, -0.05), autonomy=(), motion=Brick(), mass=3.0
    )
    sim = ground([brick], end=5.0, remove_on_collision=False)
    sim.step(3)
    speed = sim.read("a.vel")[0][0, 0, 2]
    sim.step(20)
    assert sim.read("a.vel")[0][0, 0, 2] == pytest.approx(speed)
    assert sim.result()[0].metrics["GroundNotes"]["n"] == 1


def test_nobody_is_placed_in_the_ground():
    crowd = block(position=(0.0, 0.0, 1.0), variance=(0.0, 0.0, 100.0), count=50)
    sim = ground([crowd], ground_collision_z=0.5)
    assert sim.read("a.pos")[0][0, :, 2].min() > 0.5
    assert sim.read("a.pos")[1].all()
    with pytest.raises(MissionError, match="no free position"):
        ground([block(position=(0.0, 0.0, -5.0), count=1)])
    sim = ground([block(position=(0.0, 0.0, -5.0))], enable_startup_collisions=False)
    assert not sim.read("a.pos")[1].any()


# -- SimpleCollisionMetrics -------------------------------------------------------------------------------------------------------


def head_on(name, x, vx, **values):
    return block(name, position=(x, 0.0, 0.0), autonomy=Drift(to=(vx, 0.0, 0.0)), **values)


def test_both_of_a_collision_count_and_survivors_fly_to_the_end():
    south = Drift(to=(0.0, -10.0, 0.0))
    blocks = [
        head_on("a", -10.0, 10.0, team=1), head_on("b", 10.0, -10.0, team=2), block("far", team=1, position=(0.0, 500.0, 0.0)),
        block("c", team=2, position=(0.0, -500.0, 0.0)), block("d", team=2, position=(0.0, -495.0, 0.0), autonomy=south),
    ]  # fmt: skip
    metric = SimpleCollisionMetrics(flight_time_w=2.0, team_collisions_w=-3.0, non_team_collisions_w=-5.0)
    sim = Simulation(mission(*blocks, interactions=[SimpleCollision()], metrics=[metric], end=4.0))
    counted = sim.run()[0].metrics["SimpleCollisionMetrics"]
    assert counted["non_team_coll"] == {1: 1, 2: 1}
    assert counted["team_coll"] == {1: 0, 2: 2}
    assert counted["entity_count"] == {1: 2, 2: 3}
    # a and b meet when they are nearer than 2 m, in the step that ends at 1.0 s; c and d (c flies East) in the one that ends at 0.4 s
    assert counted["flight_time"] == pytest.approx({1: 4.0 + 1.0, 2: 1.0 + 2 * 0.4})
    assert counted["flight_time_norm"] == pytest.approx({1: 5.0 / 4.0, 2: 1.8 / 4.0})
    assert counted["score"] == pytest.approx({1: 2.0 * 1.25 - 5.0, 2: 2.0 * 0.45 - 5.0 - 6.0})


def test_a_team_that_comes_late_is_counted_from_its_coming():
    late = block(
        "late",
        team=2,
        count=2,
        rate=2.0,
        first_birth=1.0,
        position=(0.0, 0.0, 50.0),
        variance=(400.0, 400.0, 0.0),
    )
    sim = Simulation(mission(block("a", team=1), late, metrics=[SimpleCollisionMetrics()], end=3.0))
    counted = sim.run()[0].metrics["SimpleCollisionMetrics"]
    assert counted["entity_count"] == {1: 1, 2: 2}
    assert counted["flight_time"] == pytest.approx({1: 3.0, 2: 2.0 + 1.5})
    assert counted["flight_time_norm"] == pytest.approx({1: 1.0, 2: 3.5 / 3.0})
    assert all(math.isfinite(score) for score in counted["score"].values())


def test_before_the_first_step_nothing_has_flown():
    sim = Simulation(mission(block("a", team=1, count=3), metrics=[SimpleCollisionMetrics()]))
    counted = sim.result()[0].metrics["SimpleCollisionMetrics"]
    assert counted["entity_count"] == {1: 3}
    assert counted["flight_time"] == {1: 0.0}
    assert counted["flight_time_norm"] == {1: 0.0}


def test_those_who_die_in_a_step_have_flown_it():
    sim = Simulation(
        mission(
            block("a", team=1, count=2), interactions=[Reaper(at=0.5)], metrics=[SimpleCollisionMetrics()]
        )
    )
    assert sim.run()[0].metrics["SimpleCollisionMetrics"]["flight_time"] == pytest.approx({1: 2 * 0.5})


# -- CPA --------------------------------------------------------------------------------------------------------------------------


def passing(**values):
    """One that flies East past a post 3 m beside its way, at 1.5 s, and past a team mate 1 m beside it, at 2.5 s."""
    blocks = [
        block("flyer", team=1, position=(-15.0, 0.0, 0.0), autonomy=Drift(to=(10.0, 0.0, 0.0))),
        block("post", team=2, position=(0.0, 3.0, 0.0), autonomy=Drift(to=(0.0, 0.0, 0.0))),
        block("mate", team=1, position=(10.0, -1.0, 0.0), autonomy=Drift(to=(0.0, 0.0, 0.0))),
    ]
    sim = Simulation(mission(*blocks, metrics=[CPA(**values)], end=4.0), seeds=[1, 2])
    one, two = sim.run()
    assert one.metrics == two.metrics
    found = one.metrics["CPA"]
    return {
        team: tuple(found[k][team] for k in ("cpa", "cpa_entity", "cpa_other", "cpa_time")) for team in (1, 2)
    }


def test_the_least_distance_of_each_team_who_and_when():
    found = passing()
    assert found[1] == pytest.approx((1.0, 1, 3, 2.5))
    assert found[2] == pytest.approx((3.0, 2, 1, 1.5))


def test_team_mates_only():
    found = passing(team_cpa=True)
    assert found[1] == pytest.approx((1.0, 1, 3, 2.5))
    assert found[2] == (math.inf, 0, 0, 0.0)


def test_one_team_only():
    assert passing(team_id=2) == {1: (math.inf, 0, 0, 0.0), 2: (math.inf, 0, 0, 0.0)}
    assert passing(team_id=1)[1] == pytest.approx((1.0, 1, 3, 2.5))


def test_from_one_time_to_another():
    assert passing(max_time_s=1.9)[1] == pytest.approx((3.0, 1, 2, 1.5))
    assert passing(min_time_s=3.0)[1] == pytest.approx((math.hypot(5.0, 1.0), 1, 3, 3.0))
