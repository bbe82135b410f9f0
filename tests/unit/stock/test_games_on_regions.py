"""Boundaries that are enforced and defended, and flags, by small games computed by hand."""

from __future__ import annotations

import numpy as np
import pytest
from small_worlds import Drift, block, mission

from tussle import Simulation
from tussle.api import Autonomy, Metric, Output, Param, State
from tussle.errors import MissionError, TussleError
from tussle.messages import EntityCaptured, FlagCaptured, FlagTaken
from tussle.stock import (
    AutonomyExecutor,
    Boundary,
    BoundaryDefense,
    CaptureInBoundaryInteraction,
    EnforceBoundaryInteraction,
    FlagCaptureInteraction,
    FlagCaptureMetrics,
    SimpleCaptureMetrics,
    SingleIntegrator,
    TakeFlag,
)

RUNS = SingleIntegrator(max_speed=10.0)  # 1 m a step


def ball(number, x, radius=5.0, team=1, y=0.0):
    """A spherical boundary."""
    return Boundary(
        name=f"b{number} at {x}", boundary_id=number, team=team, shape="sphere", center=(x, y, 0), radius=radius
    )  # fmt: skip


class Told(Metric):
    """The step and the id of the last capture, flag taken and flag captured, and how often."""

    step_of = State("hit taken home", dtype=int, per="world")
    who = State("hit taken home", dtype=int, per="world")
    n = State("hit taken home", dtype=int, per="world")

    def step(self, w):
        for i, (event, who) in enumerate(
            ((EntityCaptured, "source"), (FlagTaken, "entity"), (FlagCaptured, "entity"))
        ):
            told = w.inbox(event)
            self.step_of[i, told.world] = w.step_count[told.world] + 1
            self.who[i, told.world] = getattr(told, who)
            np.add.at(self.n[i], told.world, 1)


def steps_flown(sim, name):
    """How many steps the only entity of a block was there, in a simulation that has not begun."""
    n = 0
    while not sim.is_over and sim.read(f"{name}.pos")[1][0, 0]:
        sim.step()
        n += 1
    return n


def test_outside_all_boundaries_and_inside_a_no_fly_region():
    rules = [
        ball(1, 0.0, 10.5),
        ball(2, 18.0, 8.5),
        ball(3, 0.0, 0.3, y=5.2),
        EnforceBoundaryInteraction(active_boundary_ids=(1, 2), no_fly_boundary_ids=(3,)),
    ]
    east, north = (block(n, autonomy=Drift(to=to)) for n, to in (("e", (10, 0, 0)), ("n", (0, 10, 0))))
    game = mission(east, north, interactions=rules, end=10.0)
    assert steps_flown(Simulation(game), "e") == 27  # the second ball ends at 26.5 m
    assert steps_flown(Simulation(game), "n") == 5  # 5 m lies in the hole
    fenced = game.replace(interactions=[*rules[:2], EnforceBoundaryInteraction(active_boundary_ids="1 2")])
    assert steps_flown(Simulation(fenced), "n") == 11
    free = game.replace(interactions=[EnforceBoundaryInteraction(active_boundary_ids=())])
    assert steps_flown(Simulation(free), "e") == 100


@pytest.mark.parametrize(
    ("rules", "text"),
    [
        (
            [ball(5, 0.0)],
            "EnforceBoundaryInteraction.*no boundaries of the mission have the id 1; there are: 5",
        ),
        ([ball(1, 0.0), ball(1, 9.0)], "2 boundaries of the mission have the id 1"),
    ],
)
def test_an_id_belongs_to_one_boundary(rules, text):
    with pytest.raises(MissionError, match=text):
        mission(interactions=[*rules, EnforceBoundaryInteraction(active_boundary_ids=(1,))])


@pytest.mark.parametrize("autonomy", [TakeFlag(), AutonomyExecutor(autonomies=[TakeFlag()])])
def test_a_region_that_entities_born_later_need_is_missed_before_the_game(autonomy):
    late = block("late", autonomy=autonomy, rate=1.0, first_birth=5.0)
    with pytest.raises(
        MissionError, match="block 'late': TakeFlag: no boundaries of the mission have the id 1"
    ):
        mission(late, interactions=[])


def test_a_concave_no_fly_region_and_a_polyhedron():
    corners = "[ 3.5 -9 ] [ 12.5 -9 ] [ 12.5 9 ] [ 3.5 9 ] [ 3.5 1 ] [ 9.5 1 ] [ 9.5 -1 ] [ 3.5 -1 ]"
    rules = [
        Boundary(name="zone", boundary_id=1, shape="polygon", polygon_points=corners, lengths=(1, 1, 20)),
        EnforceBoundaryInteraction(active_boundary_ids=(2,), no_fly_boundary_ids=(1,)),
        Boundary(
            name="pyramid", boundary_id=2, shape="polyhedron",
            polyhedron_points=((20, 20, -20), (20, -20, -20), (-20, 20, -20), (-20, -20, -20), (0, 0, 20.5)),
        ),
    ]  # fmt: skip
    ways = {"notch": (0, 0, 0), "wall": (0, 2, 0), "under": (0, 2, -11), "top": (0, 0, 10.2)}
    blocks = [block(name, position=at, autonomy=Drift(to=(10, 0, 0))) for name, at in ways.items()]
    game = mission(*blocks, interactions=rules, end=10.0)
    steps = {name: steps_flown(Simulation(game), name) for name in ways}
    # The pyramid is 20 (20.5 - z) / 40.5 wide to one side at height z.
    assert steps == {"notch": 10, "wall": 4, "under": 16, "top": 6}
    assert rules[0].regions()[0].center == (7.25, 0.0, 0.0)
    assert rules[2].regions()[0].center == (0.0, 0.0, -11.9)


def guarded(*intruders, end=3.0, guards=((0.0, 0.0),), **rule):
    """Resting defenders of team 1 at (x, y) in a ball of 20 m, and intruders that come along the x axis at 10 m/s."""
    home = [block(f"g{i}", team=1, position=(x, y, 0), autonomy=Drift(to=(0, 0, 0))) for i, (x, y) in enumerate(guards)]  # fmt: skip
    away = [
        block(f"i{i}", team=2, position=(x, 0, 0), autonomy=Drift(to=(-10, 0, 0)))
        for i, x in enumerate(intruders)
    ]
    return mission(
        *home,
        *away,
        interactions=[ball(1, 0.0, 20.0), CaptureInBoundaryInteraction(**rule)],
        metrics=[SimpleCaptureMetrics(), Told()],
        end=end,
    )


def test_defenders_capture_where_both_are_inside():
    assert steps_flown(Simulation(guarded(15.5)), "i0") == 11  # 4.5 m left
    # The defender outside captures nobody; nor is anybody captured outside, though within range.
    assert steps_flown(Simulation(guarded(25.5, guards=((21.0, 0.0),))), "i0") == 30
    assert steps_flown(Simulation(guarded(27.5, guards=((19.0, 0.0),), capture_range=9.0)), "i0") == 8
    result = Simulation(guarded(9.5, 10.0)).run()[0]
    assert result.metrics["SimpleCaptureMetrics"]["NonTeamCapture"] == {1: 2, 2: 0}


def test_the_nearest_defender_captures_and_then_cools_down():
    sim = Simulation(guarded(10.5, guards=((0.0, 3.0), (0.0, -2.0), (0.0, 2.0))))
    sim.run()
    assert sim.read("Told.who")[0][0, 0] == 2  # entities 2 and 3 are equally near
    # Both arrive in step 6, at 4.5 and 4.6 m: one is captured; the other gets out of range in step 16.
    assert steps_flown(Simulation(guarded(10.5, 10.6, cool_down_period=0.8)), "i1") == 14
    assert steps_flown(Simulation(guarded(10.5, 10.6, cool_down_period=1.0)), "i1") == 30
    assert steps_flown(Simulation(guarded(10.5, 10.6)), "i1") == 6


def flag_game(*runners, end=30.0, **rule):
    """Runners of team 2 from x [m] to a flag at 0 and home to a ball at 50 m."""
    blocks = [
        block(f"r{i}", team=2, position=(x, 0, 0), autonomy=TakeFlag(flag_boundary_id=1, capture_boundary_id=2), motion=RUNS)
        for i, x in enumerate(runners)
    ]  # fmt: skip
    return mission(
        block("home", team=1, position=(0, 900, 0), autonomy=Drift(to=(0, 0, 0))),
        *blocks,
        interactions=[
            ball(1, 0.0),
            ball(2, 50.0, team=2),
            FlagCaptureInteraction(flag_boundary_id=1, capture_boundary_id=2, **rule),
        ],
        metrics=[FlagCaptureMetrics(flags_taken_w=10.0, flags_captured_w=100.0), Told()],
        end=end,
    )


def test_a_flag_is_fetched_once():
    sim, told = Simulation(flag_game(30.5)), []
    sim.events.listen(told.append)
    result = sim.run()[0]
    flags = [(e.step.tolist(), e.id.tolist(), e.text) for e in told if e.kind == "flag"]
    assert flags == [([27], [2], ["took the flag"]), ([70], [2], ["brought the flag home"])]
    # 21 steps of 1 m to 9.5 m, and 7 that leave 0.9 of the distance each, to 4.54 m; then 36 to 40.54 m, and 7 to 45.47 m.
    assert sim.read("Told.step_of")[0][0, 1:].tolist() == [28, 71]
    assert result.metrics["FlagCaptureMetrics"] == {
        "flags_taken": {1: 0, 2: 1},
        "flags_captured": {1: 0, 2: 1},
        "score": {1: 0.0, 2: 110.0},
    }


def test_the_nearest_of_several_takes_the_flag_and_the_others_go_on():
    sim = Simulation(flag_game(-10.2, 10.4, 10.1, end=1.0), seeds=[1, 2])
    sim.run()
    assert sim.read("FlagCaptureInteraction.carrier")[0].tolist() == [4, 4]
    assert sim.read("Told.n")[0][:, 1].tolist() == [1, 1]
    assert [bool(sim.read(f"r{i}.TakeFlag.has_flag")[0][0, 0]) for i in range(3)] == [False, False, True]


def test_a_flag_whose_carrier_is_gone_is_free():
    game = flag_game(10.5, 30.5, end=6.0)
    hole = [
        EnforceBoundaryInteraction(active_boundary_ids=(), no_fly_boundary_ids=(3,)),
        ball(3, 40.0, 0.6),
    ]
    sim = Simulation(game.replace(interactions=[*game.interactions, *hole]))
    sim.run()
    # The first takes it in step 8, at 4.54 m, and is removed at 39.54 m, in step 43; the second waits at 0 and takes it in step 44.
    assert sim.read("Told.step_of")[0][0, 1] == 44
    assert sim.read("FlagCaptureInteraction.carrier")[0][0] == 3


def test_the_owners_do_not_take_their_flag():
    game = flag_game(10.5, end=2.0)
    own = game.replace(blocks=[b.replace(team=1) for b in game.blocks])
    assert Simulation(own).run()[0].metrics["FlagCaptureMetrics"]["flags_taken"] == {1: 0}


def test_defenders_head_off_the_nearest_intruder_and_return():
    guard = block("g", team=1, position=(0, 0, 0), autonomy=BoundaryDefense(), motion=RUNS)
    near = block("n", team=2, position=(12, 0, 0), autonomy=Drift(to=(-2, 0, 0)))
    nearer = block("o", team=2, position=(0, -31, 0), autonomy=Drift(to=(0, 0, 0)))  # outside
    game = mission(
        guard,
        near,
        nearer,
        interactions=[ball(1, 3.0, 30.0), CaptureInBoundaryInteraction(capture_range=1.0)],
        end=5.0,
    )
    sim = Simulation(game)
    sim.step(3)
    assert sim.read("g.pos")[0][0, 0] == pytest.approx([3.0, 0.0, 0.0])
    sim.step(40)
    assert sim.read("n.pos")[1].tolist() == [[False]]
    assert abs(sim.read("g.pos")[0][0, 0, 0] - 3.0) <= 1.0  # it swings about the centre in steps of 1 m


def test_entities_born_later_know_the_regions():
    late = block(
        "late", team=2, count=2, rate=1.0, first_birth=0.5, position=(20, 0, 0), autonomy=TakeFlag(), motion=RUNS
    )  # fmt: skip
    sim = Simulation(mission(late, interactions=[ball(1, 0.0), ball(2, 50.0, team=2)], end=1.0))
    sim.run()
    assert sim.read("late.pos")[0][0, 0, 0] == pytest.approx(15.0)


class Chooser(Autonomy):
    """Flies to the nearest two even ids."""

    wrong = Param("", choices=("", "both", "shape"), doc="What is wrong.")
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")
    found = State("first second", dtype=int)

    def step(self, g):
        mask = g.bodies.id % 2 == 0
        mask = mask[:-1] if self.wrong == "shape" else mask
        near = g.nearest(2, teams="own" if self.wrong == "both" else None, among=mask)
        self.found[:] = np.where(near.other < 0, 0, g.bodies.id[near.other])
        self.velocity[:] = 0.0


def test_the_nearest_of_some_rows():
    game = mission(block(count=9, variance=(100, 100, 100), autonomy=Chooser()), end=0.1)
    sim = Simulation(game, seeds=[1, 2])
    pos = sim.read("a.pos")[0]
    sim.step()
    found = sim.read("a.Chooser.found")[0]
    ids = np.arange(1, 10)
    for world, me in np.ndindex(2, 9):
        others = [i for i in ids if i % 2 == 0 and i != me + 1]
        others.sort(key=lambda i: np.linalg.norm(pos[world, i - 1] - pos[world, me]))
        assert found[world, me].tolist() == others[:2]
    for wrong, text in (("both", "teams or among, not both"), ("shape", r"mask of shape \(9,\), not bool")):
        broken = game.replace(blocks=[game.blocks[0].replace(autonomy=Chooser(wrong=wrong))])
        with pytest.raises(TussleError, match=text):
            Simulation(broken).run()
