"""Planning problems and plans."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from tussle.api import MotionModel
from tussle.arguments import check_kind
from tussle.documents import POSITIVE, Checked, Either, Real, Whole, check_argument, problem
from tussle.errors import ParameterError, listed, nearest_name
from tussle.world.scene import Scene

POSITION = ("x", "y", "z")
MAX_STEPS = 10**6
"""Largest number of steps of a command, and of substeps."""
THREE = Either(
    (Checked([Real()], lambda numbers, _: "" if len(numbers) == 3 else "their number"),),
    "three finite numbers",
)
RANGE = Either(
    (Checked([Real()], lambda ends, _: "" if len(ends) == 2 and ends[0] <= ends[1] else "their order"),),
    "two finite numbers in ascending order",
)
GOAL_TICKS = 11
"""Places along a diameter of the goal at which obstacles are looked for; odd, so that its center is one."""


@dataclass(frozen=True)
class Problem:
    """A way for a vehicle from a state to a place, around the obstacles of a scene.

    A plan is a sequence of commands, each constant for `shortest` to `longest` steps.

    Attributes:
        motion: The motion model, with state fields x, y and z [m].
        start: Initial state by field; fields that are not named are 0.
        goal: Center of the goal [m], (x, y, z).
        goal_radius: The goal is reached at this distance [m].
        bounds: State field -> its least and largest allowed value; x, y and z that are not named are not bounded.
        commands: Input -> its least and largest value.
        held: Other inputs, for instance forces or mass, that have a constant value; by default that of an optional input is its default,
            and that of others 0.
        scene: Obstacles.
        radius: The vehicle is a sphere of this radius [m].
        dt: Length of a step [s], as in the mission.
        substeps: Substeps of the motion model per step, as the mission's motion_multiplier.
        shortest: Least number of steps of a command.
        longest: Largest number of steps of a command.

    Raises:
        ParameterError: A name is unknown, or a value is not allowed: the start or the goal is not finite, outside the bounds, or in
            an obstacle.
    """

    motion: MotionModel
    start: Mapping[str, float]
    goal: Sequence[float]
    goal_radius: float
    bounds: Mapping[str, tuple[float, float]]
    commands: Mapping[str, tuple[float, float]]
    held: Mapping[str, float] = field(default_factory=dict)
    scene: Scene = field(default_factory=Scene)
    radius: float = 0.0
    dt: float = 0.1
    substeps: int = 1
    shortest: int = 1
    longest: int = 20

    def __post_init__(self) -> None:
        mappings = dict.fromkeys(("start", "bounds", "commands", "held"), Mapping)
        for key, kind in {"motion": MotionModel, "scene": Scene, **mappings}.items():
            check_kind(key, getattr(self, key), kind)
        name = type(self.motion).__name__
        self.check_names("start", self.start, self.fields)
        self.check_names("bounds", self.bounds, self.fields)
        self.check_names("commands", self.commands, self.inputs)
        self.check_names("held", self.held, self.inputs)
        if not set(POSITION) <= set(self.fields):
            raise ParameterError(f"{name} has no state fields x, y, z; it has {', '.join(self.fields)}")
        if not self.commands:
            raise ParameterError(f"commands is empty; it takes one or more of {', '.join(self.inputs)}")
        for owner, ranges in (("bounds", self.bounds), ("commands", self.commands)):
            for key, ends in ranges.items():
                check_argument(f"{owner}: {key}", _as_list(ends), RANGE)
        for key, value in self.held.items():
            check_argument(f"held: {key}", value, Real())
        if not {"x", "y"} <= set(self.bounds):
            raise ParameterError("bounds of x and y are missing")
        check_argument("goal", _as_list(self.goal), THREE)
        numbers = {"goal_radius": POSITIVE, "radius": Real(0.0), "dt": POSITIVE}
        counts = dict.fromkeys(("shortest", "longest", "substeps"), Whole(1, MAX_STEPS))
        for key, rule in (numbers | counts).items():
            check_argument(key, getattr(self, key), rule)
        if self.shortest > self.longest:
            raise ParameterError(
                f"shortest <= longest is required; they are {self.shortest} and {self.longest}"
            )
        self._check_start()
        self._check_goal()

    def _check_start(self) -> None:
        """Raise a `ParameterError` if no plan can begin at the start."""
        for name, given in self.start.items():
            if problem(given.item() if isinstance(given, np.generic) else given, Real()):
                raise ParameterError(f"start: {name} = {given!r} is not a finite number")
        for name, value in zip(self.fields, self.first.tolist(), strict=True):
            low, high = self.bounds.get(name, (-np.inf, np.inf))
            if not low <= value <= high:
                raise ParameterError(f"start: {name} = {value:g} is outside the bounds, {low:g} to {high:g}")
        if not self.is_allowed(self.first[:, None])[0]:
            raise ParameterError(
                f"the start, {self._shown(self.first[self.position])}, is in an obstacle or less than radius = {self.radius:g} m from one"
            )

    def _check_goal(self) -> None:
        """Raise a `ParameterError` if no plan can end in the goal."""
        goal = np.array(self.goal, float)
        ranges = np.array([self.bounds.get(name, (-np.inf, np.inf)) for name in POSITION])
        gap = goal - np.clip(goal, *ranges.T)
        if np.sqrt(gap @ gap) > self.goal_radius:
            name = POSITION[int(np.abs(gap).argmax())]
            low, high = self.bounds[name]
            raise ParameterError(
                f"the goal cannot be reached: {name} = {goal[POSITION.index(name)]:g} is outside the bounds, {low:g} to {high:g}, by more "
                f"than goal_radius = {self.goal_radius:g} m"
            )
        if self.scene.solids:
            ticks = np.linspace(-1.0, 1.0, GOAL_TICKS)
            grid = np.stack(np.meshgrid(ticks, ticks, ticks)).reshape(3, -1)
            places = goal[:, None] + self.goal_radius * grid[:, (grid * grid).sum(axis=0) <= 1.0]
            places = np.clip(places, ranges[:, :1], ranges[:, 1:])
            if not self.scene.free(np.ascontiguousarray(places), self.radius).any():
                raise ParameterError(
                    f"the goal cannot be reached: all places within goal_radius = {self.goal_radius:g} m of {self._shown(goal)} are in an "
                    f"obstacle or less than radius = {self.radius:g} m from one"
                )

    @staticmethod
    def _shown(place: np.ndarray) -> str:
        return f"({', '.join(f'{x:g}' for x in place.tolist())})"

    def check_names(self, what: str, given: Mapping[str, Any], allowed: Sequence[str]) -> None:
        """Raise a `ParameterError` for a name that is not allowed in the argument `what`."""
        for name in given:
            if name not in allowed:
                raise ParameterError(
                    f"{what}: {type(self.motion).__name__} has no {name!r}{nearest_name(name, allowed)}; {listed(allowed)}"
                )

    @cached_property
    def fields(self) -> tuple[str, ...]:
        """Fields of the state, in order."""
        return tuple(self.motion.state().fields)

    @cached_property
    def inputs(self) -> tuple[str, ...]:
        """Inputs of the motion model, in order."""
        return (*self.motion.input_channels(), *self.motion.body_inputs())

    @cached_property
    def _held(self) -> np.ndarray:
        """Values of the inputs, (k,), where no command sets them."""
        optional = [column for column in type(self.motion).inputs().values() if column.optional]
        rest = {name: column.default for column in optional for name in column.channels}
        return np.array([float({**rest, **self.held}.get(name, 0.0)) for name in self.inputs])

    @cached_property
    def first(self) -> np.ndarray:
        """The initial state, (m,)."""
        return np.array([self.start.get(name, 0.0) for name in self.fields])

    @cached_property
    def bounded(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Rows of the bounded fields in the state, and their least and largest values, (d,) each."""
        rows = np.array([self.fields.index(name) for name in self.bounds])
        low, high = np.array(list(self.bounds.values()), float).T
        return rows, low, high

    @cached_property
    def position(self) -> list[int]:
        """Rows of x, y and z in the state."""
        return [self.fields.index(name) for name in POSITION]

    def whole(self, commands: np.ndarray) -> np.ndarray:
        """All inputs, (k, n), from those that are planned, (c, n)."""
        u = np.repeat(self._held[:, None], commands.shape[1], axis=1)
        u[[self.inputs.index(name) for name in self.commands]] = commands
        return u

    def propagate(self, x: np.ndarray, commands: np.ndarray, n_steps: int) -> np.ndarray:
        """States, (n_steps + 1, m, n), from states (m, n) under constant commands (c, n): the rollout of the motion model."""
        u = self.whole(commands)
        return self.motion.rollout(x, np.broadcast_to(u, (n_steps, *u.shape)), self.dt, self.substeps)

    def is_allowed(self, x: np.ndarray, before: np.ndarray | None = None) -> np.ndarray:
        """Return True if states (m, n) are finite, within the bounds and free of obstacles, (n,).

        With the states one step before, (m, n), the straight way from there must be free too.
        """
        rows, low, high = self.bounded
        inside = (x[rows] >= low[:, None]) & (x[rows] <= high[:, None])
        allowed: np.ndarray = inside.all(axis=0) & np.isfinite(x).all(axis=0)
        if self.scene.solids:
            some = np.flatnonzero(allowed)
            a, b = (state[self.position][:, some] for state in (x if before is None else before, x))
            allowed[some] = self.scene.free_between(a, b, self.radius)
        return allowed

    @property
    def is_at_goal(self) -> bool:
        """Whether the start is in the goal, so that nothing is to be planned."""
        return bool(self.distance(self.first) <= self.goal_radius)

    def empty_plan(self) -> Plan:
        """The plan to stay at the start."""
        place = self.first[self.position]
        return Plan(
            problem=self,
            is_solved=True,
            commands=np.zeros((0, len(self.commands))),
            steps=np.zeros(0, np.int64),
            nodes=place[:, None],
            parents=np.full(1, -1),
            costs=np.zeros(1),
            n_propagated=0,
        )

    def distance(self, x: np.ndarray) -> np.ndarray:
        """Distance of states (m, ...) to the goal [m], (...)."""
        goal = np.reshape(self.goal, (3,) + (1,) * (x.ndim - 1))
        gap: np.ndarray = np.sqrt(((x[self.position] - goal) ** 2).sum(axis=0))
        return gap


def _as_list(numbers: Any) -> Any:
    """A list of plain numbers of a sequence; anything else as it is."""
    if not isinstance(numbers, (tuple, list, np.ndarray)):
        return numbers
    return [each.item() if isinstance(each, np.generic) else each for each in numbers]


@dataclass(frozen=True)
class Plan:
    """The best plan that was found, and the tree that it was found in.

    Attributes:
        problem: What was asked.
        is_solved: Whether the plan reaches the goal; otherwise it leads to the node that is nearest to it.
        commands: Commands in order, (n, c).
        steps: Number of steps of each command, (n,).
        nodes: Positions of all nodes of the tree [m], (3, N); those of OMPL are without edges.
        parents: Number of each node's parent, (N,), -1 for the first.
        costs: Time from the start to each node [s], (N,).
        n_propagated: Number of steps that were computed for all branches.
    """

    problem: Problem
    is_solved: bool
    commands: np.ndarray
    steps: np.ndarray
    nodes: np.ndarray
    parents: np.ndarray
    costs: np.ndarray
    n_propagated: int

    @property
    def cost(self) -> float:
        """Duration [s]."""
        return float(self.problem.dt * self.steps.sum())

    @property
    def distance_left(self) -> float:
        """Distance from its end to the center of the goal [m]."""
        return float(self.problem.distance(self.path[-1]))

    @cached_property
    def inputs(self) -> np.ndarray:
        """All inputs of the motion model by step, (T, k)."""
        return self.problem.whole(np.repeat(self.commands, self.steps, axis=0).T).T

    @cached_property
    def path(self) -> np.ndarray:
        """States by step, (T + 1, m): what the vehicle flies with these inputs, bit for bit."""
        if not len(self.inputs):
            return self.problem.first[None]
        return self.problem.motion.rollout(
            self.problem.first, self.inputs, self.problem.dt, self.problem.substeps
        )


__all__ = ["Plan", "Problem"]
