"""Plans reach their goals, keep to the rules of the problem, and are what the vehicle flies."""

import math

import numpy as np
import pytest

from tussle import Block, Mission, Simulation
from tussle.api import Autonomy, Output
from tussle.errors import ParameterError
from tussle.plan import Problem, solve, solve_with_ompl
from tussle.plugins.plan.sst import Tree, _grow
from tussle.plugins.plan.with_ompl import _Calls
from tussle.scene import Cuboid, Scene
from tussle.stock import Multirotor, Unicycle

WALLS = [
    Cuboid(center=(50, 40, 0), lengths=(10, 80, 20)),
    Cuboid(center=(50, 97, 0), lengths=(10, 6, 20)),
]  # a gap of 14 m


def problem(**changes):
    given = {
        "motion": Unicycle(vel_max=5.0, turn_rate_max=1.0, use_pitch=False),
        "start": {"x": 10.0, "y": 10.0},
        "goal": (90.0, 10.0, 0.0),
        "goal_radius": 3.0,
        "bounds": {"x": (0, 100), "y": (0, 100), "yaw": (-math.tau, math.tau)},
        "commands": {"speed": (2.0, 5.0), "turn_rate": (-1.0, 1.0)},
        "scene": Scene(walls=WALLS),
        "radius": 1.0,
        "dt": 0.2,
    }
    return Problem(**{**given, **changes})


def check(plan):
    """The path begins at the start, is allowed in every step and between steps, and ends in the goal, by commands within their ranges."""
    asked = plan.problem
    np.testing.assert_array_equal(plan.path[0], asked.first)
    states = np.ascontiguousarray(plan.path.T)
    assert asked.is_allowed(states[:, 1:], states[:, :-1]).all()
    ways = zip(states[:, :-1].T, states[:, 1:].T, strict=True)
    points = np.concatenate([np.linspace(a, b, 101) for a, b in ways]).T
    assert asked.scene.free(points[asked.position], 0.99 * asked.radius).all()
    assert asked.distance(plan.path[-1]) <= asked.goal_radius
    low, high = np.array(list(asked.commands.values())).T
    assert ((plan.commands >= low) & (plan.commands <= high)).all()
    assert ((plan.steps >= 1) & (plan.steps <= asked.longest)).all()
    assert plan.cost == pytest.approx(asked.dt * (len(plan.path) - 1))


def test_a_plan_leads_through_the_gap_and_better_ones_are_found_later():
    plan, longer = solve(problem(), seed=1, branches=20_000), solve(problem(), seed=1, branches=60_000)
    assert plan.is_solved
    assert longer.is_solved
    check(plan)
    check(longer)
    shortest = (2 * math.hypot(36, 71) + 8 - 3) / 5  # straight to the gap, through it and back, at full speed
    assert shortest < longer.cost <= plan.cost < 1.6 * shortest
    np.testing.assert_array_equal(plan.path, solve(problem(), seed=1, branches=20_000).path)
    assert np.isfinite(plan.costs).all()
    assert (plan.parents < np.arange(len(plan.parents))).all()


def test_every_node_is_the_end_of_the_path_to_it():
    asked, chance = problem(scene=Scene(), goal=(20.0, 12.0, 0.0)), np.random.default_rng(1)
    tree = Tree(asked, np.array([2.0, 2.0, 1.0]), 20_000)
    none, start = np.zeros((2, 1)), asked.first[:, None]
    tree.add(start, np.zeros(1), np.full(1, -1), none, np.zeros(1, np.int64), np.ones(1, bool))
    for _ in range(8):
        _grow(asked, tree, chance.integers(0, tree.n, 500), chance)
    assert tree.n > 1000
    for node in chance.integers(0, tree.n, 300):
        plan = tree.plan_to(int(node), False, 0)
        assert plan.path[-1].tobytes() == tree.x[:, node].tobytes()
        assert plan.cost == pytest.approx(plan.costs[node])


def test_what_is_planned_is_what_flies():
    plan = solve(problem(), seed=2, branches=60_000, stop_at_first=True)
    assert plan.is_solved

    class Follow(Autonomy):
        """Plays the inputs of the plan."""

        command = Output("speed turn_rate velocity_z", unit="m/s rad/s m/s")

        def step(self, g):
            self.command[:] = plan.inputs[round(float(g.t[0]) / 0.2), :, None]

    body = plan.problem.motion
    block = Block(name="car", position=(10, 10, 0), autonomy=Follow(), motion=body)
    with Simulation(Mission(blocks=[block], dt=0.2, end=1000.0)) as simulation:
        for expected in plan.path[1:]:
            simulation.step()
            flown = simulation.read("car.Unicycle.x")[0][0]
            assert np.reshape(flown, -1).tobytes() == expected.tobytes()


def test_a_vehicle_with_forces_and_an_empty_scene():
    hover = Multirotor()
    asked = problem(
        motion=Unicycle(vel_max=20.0, turn_rate_max=1.0, pitch_rate_max=1.0),
        goal=(60.0, 60.0, 40.0),
        bounds={"x": (0, 100), "y": (0, 100), "z": (0, 50), "yaw": (-math.tau, math.tau), "pitch": (-1, 1)},
        commands={"speed": (5.0, 20.0), "turn_rate": (-1.0, 1.0), "pitch_rate": (-1.0, 1.0)},
        scene=Scene(),
        goal_radius=5.0,
    )
    plan = solve(asked, seed=1, branches=60_000)
    assert plan.is_solved
    check(plan)
    assert set(
        problem(motion=hover, commands={"motor_1": (0, 1)}, bounds={"x": (0, 100), "y": (0, 100)}).inputs
    ) > {
        "motor_0",
        "force_x",
    }


def test_a_goal_that_cannot_be_reached_gives_the_way_to_the_nearest_node():
    walled = Scene(walls=[Cuboid(center=(50, 50, 0), lengths=(10, 100, 20))])
    plan = solve(problem(scene=walled), seed=1, branches=20_000)
    assert not plan.is_solved
    gaps = plan.problem.distance(np.vstack([plan.nodes, np.zeros((2, plan.nodes.shape[1]))]))
    assert plan.problem.distance(plan.path[-1]) == pytest.approx(gaps.min())


@pytest.mark.parametrize(
    ("thickness", "gap", "dt"), [(0.05, 0.0, 0.5), (1.0, 0.0, 0.2), (1.0, 0.0, 0.5), (0.2, 0.3, 0.5)]
)
def test_no_plan_leads_through_a_closed_wall_or_a_gap_that_is_too_narrow(thickness, gap, dt):
    walls = [
        Cuboid(center=(50, side * (70 + gap / 2) + 50, 0), lengths=(thickness, 140, 20)) for side in (-1, 1)
    ]
    asked = problem(
        scene=Scene(walls=walls), radius=0.2, dt=dt, motion=Unicycle(vel_max=10.0, turn_rate_max=1.0, use_pitch=False),
        commands={"speed": (2.0, 10.0), "turn_rate": (-1.0, 1.0)},
    )  # fmt: skip
    plan = solve(asked, seed=1, branches=20_000, stop_at_first=True)
    assert not plan.is_solved
    assert 45.0 < plan.nodes[0].max() < 50.0  # the tree has reached the wall, not the other side


def test_planners_of_ompl_do_not_jump_over_a_wall():
    thin = Scene(walls=[Cuboid(center=(50, 50, 0), lengths=(0.05, 140, 20))])
    calls = _Calls(problem(scene=thin, radius=0.0, dt=0.5))
    before, after = [48.9, 10.0, 0.0, 0.0, 0.0], [0.0] * 5
    calls.propagate(before, [5.0, 0.0], 0.5, after)
    assert not calls.is_valid(after)
    calls.propagate(before, [2.0, 0.0], 0.5, after)
    assert after[0] == pytest.approx(49.9)
    assert calls.is_valid(after)


@pytest.mark.needs("ompl")
@pytest.mark.parametrize("planner", ["RRT", "KPIECE1", "EST"])
def test_planners_of_ompl_propagate_with_the_motion_model(planner):
    open_field = problem(scene=Scene(), goal=(40.0, 20.0, 0.0), goal_radius=8.0)
    plan = solve_with_ompl(open_field, planner, seconds=60.0)
    assert plan.is_solved
    check(plan)
    assert plan.n_propagated >= len(plan.path) - 1


@pytest.mark.parametrize(
    ("changes", "error"),
    [
        ({"start": {"north": 1.0}}, "start: Unicycle has no 'north'"),
        ({"commands": {"sped": (0, 1)}}, "did you mean 'speed'"),
        ({"bounds": {"x": (0, 100)}}, "bounds of x and y are missing"),
        ({"bounds": {"x": (0, np.nan), "y": (0, 1)}}, "two finite numbers"),
        ({"goal": (1.0, 2.0)}, "three finite numbers"),
        (
            {"start": {"x": 50.0, "y": 50.0}},
            r"the start, \(50, 50, 0\), is in an obstacle or less than radius = 1 m from one",
        ),
        ({"start": {"x": 44.5, "y": 50.0}}, "the start, .* is in an obstacle or less"),
        ({"start": {"x": -5.0}}, r"start: x = -5 is outside the bounds, 0 to 100"),
        ({"start": {"x": 1.0, "yaw": 7.0}}, "start: yaw = 7 is outside the bounds"),
        ({"start": {"x": 1.0, "pitch": math.nan}}, "start: pitch = nan is not a finite number"),
        ({"goal": (1.0, math.inf, 0.0)}, "goal = .* it takes three finite numbers"),
        (
            {"goal": (50.0, 50.0, 0.0)},
            r"the goal cannot be reached: all places within goal_radius = 3 m of \(50, 50, 0\) are in an obstacle",
        ),
        (
            {"goal": (-3.1, 50.0, 0.0)},
            r"the goal cannot be reached: x = -3\.1 is outside the bounds, 0 to 100, by more than goal_radius",
        ),
        ({"commands": {}}, "commands is empty; it takes one or more of speed, turn_rate"),
        ({"shortest": 3, "longest": 2}, "shortest <= longest"),
        ({"goal_radius": math.inf}, "goal_radius = inf is not allowed; it takes a number > 0"),
        ({"goal_radius": "3"}, "goal_radius = '3' is not allowed"),
        ({"radius": math.nan}, "radius = nan is not allowed"),
        ({"dt": math.inf}, "dt = inf is not allowed"),
        ({"substeps": 1.5}, "substeps = 1.5 is not allowed; it takes a whole number from 1"),
        ({"longest": math.inf}, "longest = inf is not allowed"),
        ({"start": {"x": "a"}}, "start: x = 'a' is not a finite number"),
        ({"start": {"x": None}}, "start: x = None is not a finite number"),
        ({"goal": ("a", 1, 2)}, "goal = .* it takes three finite numbers"),
        ({"goal": 5}, "goal = 5 is not allowed; it takes three finite numbers"),
        ({"commands": {"speed": 5}}, "commands: speed = 5 is not allowed; it takes two finite numbers"),
        ({"commands": {"speed": (1, 2, 3)}}, "commands: speed = .* two finite numbers in ascending order"),
        ({"bounds": {"x": (0, 100), "y": ("a", "b")}}, "bounds: y = .* two finite numbers"),
        ({"held": {"speed": math.nan}}, "held: speed = nan is not allowed"),
    ],
)
def test_problems_that_make_no_sense_are_refused(changes, error):
    with pytest.raises(ParameterError, match=error):
        problem(**changes)


def test_goals_of_which_a_part_can_be_reached_are_planned_to():
    """Its center is outside the bounds, or in a wall."""
    for goal in ((102.5, 10.0, 0.0), (54.5, 10.0, 0.0)):
        plan = solve(
            problem(goal=goal, start={"x": 80.0, "y": 10.0}), seed=1, branches=40_000, stop_at_first=True
        )
        assert plan.is_solved
        check(plan)


@pytest.mark.parametrize(
    "planner",
    [solve, pytest.param(lambda asked: solve_with_ompl(asked, "EST"), marks=pytest.mark.needs("ompl"))],
)
def test_a_start_in_the_goal_is_an_empty_plan(planner):
    plan = planner(problem(start={"x": 88.0, "y": 11.0}))
    assert plan.is_solved
    assert (plan.cost, plan.commands.shape, plan.inputs.shape) == (0.0, (0, 2), (0, 3))
    assert plan.path.tolist() == [[88.0, 11.0, 0.0, 0.0, 0.0]]
    assert plan.nodes.tolist() == [[88.0], [11.0], [0.0]]
    assert plan.distance_left == pytest.approx(math.hypot(2.0, 1.0))


@pytest.mark.needs("ompl")
def test_a_search_without_time_tells_how_far_it_came():
    plan = solve_with_ompl(problem(), "RRT", seconds=0.01)
    assert not plan.is_solved
    assert 3.0 < plan.distance_left <= 80.0


def test_wrong_options_are_refused():
    with pytest.raises(ParameterError, match="cells: Unicycle has no 'z'"):
        solve(problem(), cells={"z": 1.0})
    with pytest.raises(ParameterError, match="did you mean 'RRT'"):
        solve_with_ompl(problem(), "RTT")
    for options, what in (({"cells": {"x": "a"}}, "cells: x"), ({"branches": 10**12}, "branches"), ({"batch": 7}, "batch"),
                          ({"seed": -1}, "seed")):  # fmt: skip
        with pytest.raises(ParameterError, match=f"{what} = .* is not allowed; it takes"):
            solve(problem(), **options)
    for options in ({"seconds": math.nan}, {"seconds": -1}, {"seed": 0}, {"planner": None}):
        with pytest.raises(ParameterError, match="is not allowed"):
            solve_with_ompl(problem(), **options)


def test_numbers_of_numpy_are_numbers():
    given = {
        "goal": np.array([90.0, 10.0, 0.0]), "goal_radius": np.float64(3.0), "longest": np.int64(20),
        "bounds": {"x": np.array([0.0, 100.0]), "y": [0, 100]}, "start": {"x": np.float64(10.0), "y": np.float32(10.0)},
    }  # fmt: skip
    asked = problem(**given, commands={"speed": (np.float64(2.0), 5)})
    assert solve(asked, branches=np.int64(2000), seed=np.int64(1)).path.shape[1] == 5
