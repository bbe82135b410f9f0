"""From points to missions: values by path, and which points can share a stack."""

from __future__ import annotations

import pickle

import gambles
import numpy as np
import pytest
from gambles import game

from tussle import Block, Mission, Simulation
from tussle.api import Autonomy, Param, State
from tussle.batch.design_points import build_points, group_points, read_points, split, with_value
from tussle.errors import MissionError, ParameterError, TussleError
from tussle.mission.effects import exactly
from tussle.stock import AvoidEntityMS, Boundary, MotorSchemas, MoveToGoalMS, SingleIntegrator, Still


def schemas(**goal):
    """A mission with a plugin inside another."""
    inner = [MoveToGoalMS(**goal), AvoidEntityMS(name="shy", gain=2.0)]
    walker = Block(
        name="walkers", team=1, count=3, autonomy=MotorSchemas(behaviors=inner), motion=SingleIntegrator(),
    )  # fmt: skip
    return Mission(blocks=[walker], dt=0.1, end=1.0, networks=())


# -- values by path -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("path", "value", "found"),
    [
        ("run.dt", 0.05, lambda m: m.dt),
        ("run.end", 7.0, lambda m: m.end),
        ("reds.count", 9, lambda m: m.blocks[0].count),
        ("reds.speed", 3.0, lambda m: m.blocks[0].speed),
        ("Roulette.odds", 0.5, lambda m: m.interactions[0].odds),
        ("Roulette.harm", (2.0, 3.0), lambda m: m.interactions[0].harm),
        ("Chips.weight", 2.0, lambda m: m.metrics[0].weight),
        ("reds.Nervous.how", "decide", lambda m: m.blocks[0].autonomy[0].how),
    ],
)
def test_a_value_is_set_by_its_path_and_nothing_else_changes(path, value, found):
    before = game()
    after = with_value(before, path, value)
    assert found(after) == value != found(before)
    back = with_value(after, path, found(before))
    assert exactly(back) == exactly(before)


@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("red.count", 1), ("roulete.odds", 1), ("reds.counts", 1), ("reds.Nervous.how.more", 1), ("reds", 1), ("", 1), ("run.ends", 1),
        ("run.dt", -1), ("reds.count", 2.5), ("reds.motion", "Unicycle"), ("Roulette.odds", 2.0), ("run", 1), ("Roulette.odds.x", 1),
    ],
)  # fmt: skip
def test_a_path_that_leads_nowhere_and_a_value_that_is_not_allowed_are_refused(path, value):
    with pytest.raises(TussleError):
        with_value(game(), path, value)


# -- points -------------------------------------------------------------------------------------------------------------------


def test_a_function_is_called_with_all_values():
    missions = list(build_points(game, {"reds": 2}, [{"odds": 0.1}, {"odds": 0.3}]))
    assert [(m.blocks[0].count, m.interactions[0].odds) for m in missions] == [(2, 0.1), (2, 0.3)]


def no_mission(odds):
    return odds


def picky(odds):
    return game(odds=odds)


@pytest.mark.parametrize(
    ("function", "points", "words"),
    [
        (picky, [{"ods": 1}], "point 0 (ods=1): picky"),
        (no_mission, [{"odds": 1}], "point 0 (odds=1): no_mission gave 1"),
        (picky, [{"odds": 0.5}, {"odds": 7}], "point 1 (odds=7): Roulette.odds = 7"),
        (game(), [{"Roulette.odd": 1}], "point 0 (Roulette.odd=1): 'Roulette.odd'"),
    ],
)
def test_what_is_wrong_with_a_point_is_told_with_its_values(function, points, words):
    with pytest.raises((ParameterError, MissionError)) as error:
        list(build_points(function, {}, points))
    assert words in str(error.value)


def test_what_is_wrong_with_a_point_of_a_file_is_told_with_its_values(tmp_path):
    file = tmp_path / "game.xml"
    file.write_text(gambles.MISSION)
    options = {"plugin_files": (gambles.THIS,)}
    with pytest.raises(MissionError) as error:
        list(read_points(file, {}, [{"odds": "0.5"}, {"odds": "-1"}], **options))
    assert str(error.value).startswith(f"point 1 (odds=-1): {file}:5: ")
    with pytest.raises(MissionError) as error:
        list(read_points(file, {"odds": "-1"}, [{}], **options))
    assert str(error.value).startswith(f"{file}:5: ")


# -- groups -------------------------------------------------------------------------------------------------------------------


class Listed(Autonomy):
    """Has a list for a parameter."""

    rows = Param((), fields="x y", ragged=True)
    seen = State("x y", ragged=True)

    def step(self, g):
        pass


SHARED = [
    ("Roulette.odds", [0.1, 0.2, 0.3]),
    ("Roulette.harm", [(1.0, 1.0), (1.0, 2.0)]),
    ("reds.speed", [0.0, 1.0]),
    ("reds.health", [1.0, 3.0]),
    ("reds.position", [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0)]),
    ("reds.variance", [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0)]),
    ("Trouble.at", [2, 3]),
]
SPLIT = [
    ("reds.count", [1, 2, 3]),
    ("reds.scatter_first", [False, True]),
    ("reds.motion", [Still(), SingleIntegrator()]),
    ("run.dt", [0.1, 0.05]),
    ("run.end", [1.0, 2.0]),
    ("run.end_conditions", ["time", "time, all_dead"]),
    ("Roulette.rule", ["all", "first"]),
    ("Roulette.is_gentle", [False, True]),
    ("reds.Nervous.how", ["never", "spawn"]),
]


@pytest.mark.parametrize(("path", "values"), SHARED, ids=[p for p, _ in SHARED])
def test_points_that_differ_in_numbers_of_one_world_share_a_stack(path, values):
    missions = [with_value(game(), path, v) for v in values]
    design_points, package = group_points(missions)
    assert len(package.missions) == 1
    assert [t.params for t in design_points] == [{path: v} for v in values]


@pytest.mark.parametrize(("path", "values"), SPLIT, ids=[p for p, _ in SPLIT])
def test_points_that_differ_in_structure_do_not(path, values):
    missions = [with_value(game(), path, v) for v in [*values, *values]]
    design_points, package = group_points(missions)
    n = len(values)
    assert [t.group for t in design_points] == [*range(n), *range(n)]
    assert all(t.params == {} for t in design_points)
    for i, mission in enumerate(missions[:n]):
        assert exactly(pickle.loads(package.missions[i])) == exactly(mission)


def test_a_world_plugin_that_is_structural_splits():
    def fenced(radius):
        return game().replace(interactions=[Boundary(shape="sphere", radius=radius)])

    design_points, package = group_points([fenced(r) for r in (100.0, 200.0, 100.0)])
    assert [t.group for t in design_points] == [0, 1, 0]
    assert len(package.missions) == 2


def test_values_are_sent_only_where_they_differ_within_a_group():
    missions = [
        with_value(with_value(game(odds=0.3), "reds.count", n), "reds.health", h)
        for n in (1, 2)
        for h in ((1.0, 1.0) if n == 1 else (1.0, 2.0))
    ]
    design_points, _ = group_points(missions)
    assert [t.params for t in design_points] == [{}, {}, {"reds.health": 1.0}, {"reds.health": 2.0}]


@pytest.mark.parametrize(
    ("path", "values"),
    [
        ("walkers.MotorSchemas.MoveToGoalMS.goal", [(9.0, 0.0, 0.0), (0.0, 9.0, 1.0)]),
        ("walkers.MotorSchemas.MoveToGoalMS.distance_pid", [(0.5, 0.0, 0.0, 0.0), (0.1, 0.2, 0.0, 5.0)]),
        ("walkers.MotorSchemas.MoveToGoalMS.use_initial_heading", [False, True]),
        ("walkers.MotorSchemas.shy.gain", [0.5, 2.0]),
        ("walkers.health", [1.0, 2.0]),
    ],
)
def test_a_world_of_a_stack_with_values_of_its_own_is_the_mission_of_its_point(path, values):
    missions = [with_value(schemas(goal=(30.0, 40.0, 5.0)), path, v) for v in values]
    design_points, package = group_points(missions)
    assert len(package.missions) == 1
    params = {p: [t.params[p] for t in design_points] for p in design_points[0].params}
    with Simulation(package.mission(0), [1, 1], params) as stack:
        together = [r.state_hash for r in stack.run()]
    assert together[0] != together[1]
    for mission, found in zip(missions, together, strict=True):
        with Simulation(mission, 1) as simulation:
            assert simulation.run()[0].state_hash == found


def test_a_missions_text_has_every_digit_of_every_number():
    def listed(n, last):
        rows = [(float(i), 0.1 + 0.2) for i in range(n)] + [(last, 1.0)]
        block = Block(name="b", team=1, autonomy=Listed(rows=rows), motion=Still())
        return exactly(Mission(blocks=[block], end=0.2))

    assert listed(3000, 1.0) != listed(3000, np.nextafter(1.0, 2.0))


def test_points_whose_behaviours_act_in_other_states_share_no_stack():
    assert split(schemas(states="x y"))[0] == split(schemas(states=["x", "y"]))[0]
    assert split(schemas(states="x"))[0] != split(schemas(states="y"))[0]
