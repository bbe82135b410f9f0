"""OMPL's planners with a motion model as the propagator; needs the extra `plan`."""

from __future__ import annotations

from typing import Any

import numpy as np

from tussle.arguments import explained
from tussle.documents import Real, Whole, check_argument
from tussle.errors import MissingExtraError
from tussle.plugins.plan.problem import Plan, Problem

PLANNERS = ("RRT", "KPIECE1", "EST")
"""OMPL's SST and PDST cannot be made in Python, as of 2.0.1: their bindings have no constructors."""


@explained
def solve_with_ompl(problem: Problem, planner: str = "RRT", *, seed: int = 1, seconds: float = 60.0) -> Plan:
    """Search a way to the goal with a planner of OMPL (Sucan, Moll and Kavraki 2012, IEEE Robotics and Automation Magazine 19).

    OMPL's states are those of the motion model; it samples the bounded fields. It calls Python for every step, and stops at the
    first plan. Its random numbers take the seed of the first call in a process. `nodes` of the plan are the states that were
    checked, without parents.

    Args:
        problem: The planning problem.
        planner: "RRT", "KPIECE1" or "EST".
        seed: Seed of OMPL's random numbers, > 0.
        seconds: Limit of the computing time [s].

    Returns:
        The first plan. If `is_solved` is false, the time was over, and `distance_left` tells how far its end is from the goal.

    Raises:
        MissingExtraError: OMPL is not installed.
        ParameterError: There is no such planner.
    """
    check_argument("planner", planner, PLANNERS)
    check_argument("seed", seed, Whole(1, 2**32 - 1))
    check_argument("seconds", seconds, Real(0.0))
    try:
        from ompl import base, control, util
    except ImportError:
        raise MissingExtraError("solve_with_ompl needs OMPL: pip install 'tussle[plan]'") from None
    if problem.is_at_goal:
        return problem.empty_plan()
    util.setLogLevel(util.LogLevel.LOG_NONE)
    util.RNG.setSeed(seed)
    calls = _Calls(problem)
    setup = control.SimpleSetup(_control_space(base, control, problem))
    info = setup.getSpaceInformation()
    setup.setStatePropagator(calls.propagate)
    setup.setStateValidityChecker(calls.is_valid)
    info.setPropagationStepSize(problem.dt)
    info.setMinMaxControlDuration(problem.shortest, problem.longest)
    start = info.getStateSpace().allocState()
    for k, value in enumerate(problem.first):
        start[k] = float(value)
    setup.setStartState(start)

    class Goal(base.GoalRegion):  # type: ignore[misc]  # OMPL has no types
        def distanceGoal(self, state: Any) -> float:  # noqa: N802 - OMPL's name
            return float(problem.distance(calls.values(state))[0])

    goal = Goal(info)
    goal.setThreshold(problem.goal_radius)
    setup.setGoal(goal)
    setup.setPlanner(getattr(control, planner)(info))
    setup.solve(seconds)
    commands, steps = np.zeros((0, len(problem.commands))), np.zeros(0, np.int64)
    if setup.haveSolutionPath():
        path, c = setup.getSolutionPath(), range(len(problem.commands))
        n = range(path.getControlCount())
        commands = np.array([[path.getControl(i)[k] for k in c] for i in n]).reshape(-1, len(c))
        steps = np.array([round(path.getControlDuration(i) / problem.dt) for i in n], np.int64)
    nodes = np.array(calls.seen).reshape(-1, 3).T
    return Plan(
        problem=problem,
        is_solved=bool(setup.haveExactSolutionPath()),
        commands=commands,
        steps=steps,
        nodes=nodes,
        parents=np.full(nodes.shape[1], -1),
        costs=np.full(nodes.shape[1], np.nan),
        n_propagated=calls.n_steps,
    )


def _control_space(base: Any, control: Any, problem: Problem) -> Any:
    """OMPL's spaces of the states and commands of a problem."""
    space = base.RealVectorStateSpace(len(problem.fields))
    ranges = [  # fields without bounds are not sampled
        problem.bounds.get(name, (value, value + 1e-9))
        for name, value in zip(problem.fields, problem.first, strict=True)
    ]
    space.setBounds(_bounds(base, ranges))
    commands = control.RealVectorControlSpace(space, len(problem.commands))
    commands.setBounds(_bounds(base, list(problem.commands.values())))
    return commands


def _bounds(base: Any, ranges: list[tuple[float, float]]) -> Any:
    bounds = base.RealVectorBounds(len(ranges))
    for k, (low, high) in enumerate(ranges):
        bounds.setLow(k, float(low))
        bounds.setHigh(k, float(high))
    return bounds


class _Calls:
    """Callbacks for OMPL.

    Attributes:
        n_steps: Number of steps that were propagated.
        seen: Positions that were checked [m].
    """

    def __init__(self, problem: Problem) -> None:
        self.problem, self.n_steps = problem, 0
        self.seen: list[list[float]] = []

    def values(self, state: Any) -> np.ndarray:
        """The state as one column, (m, 1)."""
        return np.array([[state[k]] for k in range(len(self.problem.fields))])

    def propagate(self, state: Any, command: Any, duration: float, result: Any) -> None:
        """Write the state after `duration` [s] to `result`; NaN, which is not valid, if the way there is blocked."""
        commands = np.array([[command[k]] for k in range(len(self.problem.commands))])
        steps = max(1, round(duration / self.problem.dt))
        self.n_steps += steps
        path = self.problem.propagate(self.values(state), commands, steps)[:, :, 0].T
        is_free = self.problem.is_allowed(path[:, 1:], path[:, :-1]).all()
        end = path[:, -1] if is_free else np.full(len(path), np.nan)
        for k, value in enumerate(end.tolist()):
            result[k] = value

    def is_valid(self, state: Any) -> bool:
        """Return True if a state is allowed."""
        x = self.values(state)
        self.seen.append(x[self.problem.position, 0].tolist())
        return bool(self.problem.is_allowed(x)[0])


__all__ = ["solve_with_ompl"]
