"""Rewards: terms that are functions of the situation after a decision."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from tussle.api.bodies import DERIVED, FLOATS
from tussle.arguments import check_fields, explained
from tussle.errors import ParameterError, listed, nearest_name
from tussle.record.events import CAPTURE, COLLISION, DEATH, FLAG
from tussle.rl import kernels
from tussle.rl.action import array_of
from tussle.rl.observation import TEAMS, AgentRows, Component, Means, NearestOthers, block_numbers

if TYPE_CHECKING:
    from tussle.engine.simulation import Simulation

SHARES = ("agent", "team", "world")
COUNTED = (CAPTURE, COLLISION, DEATH, FLAG)
"""Kinds of events that a situation counts."""
IDS = ("id", "other")
SETTLE = {np.dtype(name): settle for name, settle in kernels.SETTLE.items()}
NOBODY = -1
"""Id of an agent that has not been born; events have 0 for none."""


@dataclass(frozen=True)
class FoundOthers:
    """The nearest other of each agent; of agents without one, and of the dead, `distance` is inf and the vectors are 0.

    Attributes:
        found: Who has one, (W, A).
        distance: Distance to it [m], (W, A).
        offset: Vector to it [m], (W, A, 3), world frame.
        relative_vel: Its velocity relative to the agent's [m/s], (W, A, 3), world frame.
    """

    found: np.ndarray
    distance: np.ndarray
    offset: np.ndarray
    relative_vel: np.ndarray


def read_only(array: np.ndarray) -> np.ndarray:
    """A view that cannot be written, of an array that all terms of a reward share."""
    view = array.view()
    view.flags.writeable = False
    return view


@explained
class Situation:
    """The agents of all worlds after a decision, for rewards and ends; W worlds, A agents in each. Arrays are valid until the next step.

    Attributes:
        simulation: The simulation, e.g. for `simulation.read("hunters.pos")`.
        alive: Who is alive, (W, A).
        was_alive: Who was alive before the decision, (W, A); rewards go to these.
        died: Who died, (W, A).
        actions: The actions, as given to `step`.
        team: Team of each agent's block, (A,).
        id: Id of each agent in its world, (W, A); -1 of those that have not been born.
        t: Time of each world [s], (W,).
    """

    def __init__(self, simulation: Simulation, team: np.ndarray, alive: np.ndarray) -> None:
        self.simulation = simulation
        self.team = team
        self.alive, self.was_alive, self.died = alive, alive.copy(), np.zeros_like(alive)
        self.actions: Any = None
        self.id = np.full(alive.shape, NOBODY)
        self.rows = self.agents = np.zeros(0, np.int64)
        self._events: list[Any] = []
        self._begun = np.zeros(len(alive), bool)  # worlds whose events belong to an earlier episode
        self._parts: list[AgentRows] = []
        self._columns: dict[Any, Any] = {}  # of this state
        self._components: dict[Any, tuple[Component, int]] = {}  # and their widths
        self._blocks: dict[Any, list[int]] = {}

    @property
    def t(self) -> np.ndarray:
        return self.simulation.t

    def __getattr__(self, name: str) -> np.ndarray:
        """A body column of the agents, (W, A) or (W, A, k); 0 for the dead."""
        if name not in FLOATS and name not in DERIVED:
            known = [
                *FLOATS,
                *DERIVED,
                *(k for k in (*vars(self), *vars(type(self))) if not k.startswith("_")),
            ]
            raise AttributeError(f"a situation has no {name!r}{nearest_name(name, known)}; {listed(known)}")
        if name not in self._columns:
            bodies = self.simulation.state.population.bodies
            source = bodies.derived(name) if name in DERIVED else getattr(bodies, name)
            table = np.atleast_2d(source)
            out = np.zeros((self.alive.size, len(table)))
            kernels.take(np.ascontiguousarray(table, float), self.rows, self.agents, out)
            self._columns[name] = read_only(out.reshape(*self.alive.shape, *source.shape[:-1]))
        return self._columns[name]  # type: ignore[no-any-return]

    def nearest(
        self, of: str | int | None = None, radius: float = np.inf, k: int | None = None
    ) -> FoundOthers:
        """Return the nearest other of each agent, by a search that does not visit all pairs.

        Args:
            of: Whom: "own" or "other" team, a team number, names of blocks, separated by spaces, or None for all.
            radius: Those further away do not count [m].
            k: Number of others: the arrays get an axis of k behind the agents, nearest first. By default one, without this axis.

        Raises:
            ParameterError: There is no such team or block, or a value is not allowed.
        """
        key = "nearest", of, radius, k
        if key not in self._columns:
            n = 1 if k is None else k
            names = "offset relative_vel distance present"
            seen = self._observed(key, lambda: NearestOthers(n, names, of, radius, frame="world"))
            values = seen.reshape(*self.alive.shape, *([] if k is None else [k]), 8)
            found = values[..., 7] > 0.0
            distance = np.where(found, values[..., 6], np.inf)
            parts = found, distance, values[..., :3], values[..., 3:6]
            self._columns[key] = FoundOthers(*map(read_only, parts))
        return self._columns[key]  # type: ignore[no-any-return]

    def n_within(self, radius: float, of: str | int | None = None) -> np.ndarray:
        """Return the number of others within a radius [m] of each agent, (W, A); 0 for the dead. `of` is as in `nearest`.

        Raises:
            ParameterError: There is no such team or block, or the radius is not allowed.
        """
        key = "within", of, radius
        if key not in self._columns:
            seen = self._observed(key, lambda: Means(radius, "", of))
            self._columns[key] = read_only(seen.reshape(self.alive.shape))
        return self._columns[key]  # type: ignore[no-any-return]

    def n_living(self, of: str | int) -> np.ndarray:
        """Return the number of living entities of a team, or of blocks, whose names are separated by spaces, (W,).

        Raises:
            ParameterError: There is no such team or block.
        """
        bodies, mission = self.simulation.state.population.bodies, self.simulation.mission
        if of not in self._blocks:
            if of in (None, *TEAMS):
                raise ParameterError(
                    f"n_living: of = {of!r} is not allowed; it takes a team number or names of blocks"
                )
            Means(1.0, "", of).width(mission, mission.blocks[0].name)  # refuses unknown ones
            self._blocks[of] = block_numbers(mission, of) if isinstance(of, str) else []
        if "living" not in self._columns:
            n = len(mission.blocks)
            cells = np.bincount(bodies.world * n + bodies.block, minlength=len(self.alive) * n)
            self._columns["living"] = cells.reshape(-1, n)
        if isinstance(of, str):
            return np.asarray(self._columns["living"][:, self._blocks[of]].sum(axis=1))
        return np.bincount(bodies.world[bodies.team == of], minlength=len(self.alive))

    def _observed(self, key: Any, make: Callable[[], Component]) -> np.ndarray:
        """What a component, which is made once, observes of the present state, (W A, numbers); 0 for the dead."""
        if key not in self._components:
            component, mission = make(), self.simulation.mission
            check_fields(component)
            width = max(component.width(mission, b.name) for b in mission.blocks)
            self._components[key] = component, width
        component, width = self._components[key]
        out = np.zeros((self.alive.size, width))
        for part in self._parts:
            component.write(self.simulation, part, 0, out)
        return out

    def look(self, parts: list[AgentRows]) -> None:
        """Take the agents that are there, after entities were born or removed."""
        none = [np.zeros(0, np.int64)]
        self._parts = parts
        self.rows = np.concatenate([*none, *(p.rows for p in parts)])
        self.agents = np.concatenate([*none, *(p.agents for p in parts)])

    def forget(self) -> None:
        """Discard what has been computed from the last states."""
        self._columns.clear()

    def listen(self, events: Any) -> None:
        """Keep the events of a step, of kinds that are counted."""
        self._events.append(events)

    def count(self, kind: str, ids: str = "id", text: str | None = None) -> np.ndarray:
        """Return the number of events of a kind that concern each agent in this decision, (W, A).

        Args:
            kind: "capture", "collision", "death" or "flag".
            ids: Which of an event's entities counts, "id" or "other", as in `events.arrow`.
            text: Only events with this text, such as the cause of a death.

        Raises:
            ParameterError: There is no such kind, `ids` is neither, or a mask asks for events where no environment plays.
        """
        if kind not in COUNTED:
            raise ParameterError(
                f"count: kind = {kind!r} is not allowed{nearest_name(str(kind), COUNTED)}; {listed(COUNTED)}"
            )
        if ids not in IDS:
            raise ParameterError(f"count: ids = {ids!r} is not allowed; {listed(IDS)}")
        if "_events" not in vars(self):
            raise ParameterError(
                "count: where a policy flies by itself, nothing counts the events of its decisions"
            )
        out = np.zeros(self.alive.shape)
        for events in self._events:
            if events.kind == kind:
                found = self.id[events.world] == np.asarray(getattr(events, ids))[:, None]
                found &= ~self._begun[events.world][:, None]
                if text is not None:
                    found &= (np.asarray(events.text, object) == text)[:, None]
                np.add.at(out, events.world, found)
        return out

    def clear_events(self) -> None:
        """Forget the events of the last decision."""
        self._events.clear()
        self._begun[:] = False

    def begin(self, worlds: np.ndarray) -> None:
        """Nothing has happened in worlds whose episode begins."""
        self.was_alive[worlds], self.died[worlds], self._begun[worlds] = self.alive[worlds], False, True


def alive(now: Situation) -> np.ndarray:
    """1 for the living."""
    return now.alive


def died(now: Situation) -> np.ndarray:
    """1 for those that died."""
    return now.died


def captures(now: Situation) -> np.ndarray:
    """Captures that an agent was credited with."""
    return now.count("capture")


def captured(now: Situation) -> np.ndarray:
    """1 for those that were captured and died of it."""
    return now.count("death", text="captured")


def collisions(now: Situation) -> np.ndarray:
    """Collisions of an agent with others."""
    return np.asarray(now.count("collision") + now.count("collision", "other"))


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Scalar products of vectors, (..., 3) each; several times as fast as a sum over the last axis, with the same bits."""
    return np.asarray(a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2])


def closing(now: Situation, blocks: str) -> np.ndarray:
    """Speed at which the distance to the nearest entity of some blocks decreases [m/s], (W, A); 0 without any, and for the dead."""
    near = now.nearest(blocks)
    towards = near.offset / np.maximum(near.distance, 1e-300)[..., None]
    return -dot(near.relative_vel, towards)


@dataclass(frozen=True)
class Term:
    """One term of the reward.

    Attributes:
        function: Function of a `Situation`: values for each agent, (W, A), for each world, (W, 1), or one for all.
        weight: Factor.
        per: Who receives it: "agent", or the sum over the agents of the "team" or "world".
    """

    function: Callable[[Situation], Any]
    weight: float = 1.0
    per: str = "agent"

    def __post_init__(self) -> None:
        check_fields(self)
        if self.per not in SHARES:
            raise ParameterError(f"Term: per = {self.per!r} is not allowed; {listed(SHARES)}")
        if not np.isfinite(self.weight):
            raise ParameterError(f"Term: weight = {self.weight!r} is not allowed; it takes a finite number")

    def write(self, now: Situation, out: np.ndarray) -> None:
        """Write the weighted values to out, (W, A); 0 for agents that were dead before.

        Raises:
            ParameterError: The values have another shape, or are not finite numbers.
        """
        values = array_of("returns a list", self.function(now))
        worlds, agents = out.shape
        if values.shape not in ((), (worlds, agents), (worlds, 1), (1, agents)):
            raise ParameterError(
                f"returns shape {values.shape}; it returns ({worlds}, {agents}), a value for each world and agent, or ({worlds}, 1), one "
                "for each world, such as values[:, None]"
            )
        if values.dtype.kind not in "biuf":
            raise ParameterError(
                f"returns {values.dtype}, {values.ravel()[0]!r:.40}; it returns finite numbers"
            )
        np.multiply(values, self.weight, out=out, casting="same_kind")
        wrong = int(SETTLE[out.dtype](out.reshape(-1), now.was_alive.reshape(-1)))
        if wrong >= 0:
            world, agent = divmod(wrong, agents)
            raise ParameterError(
                f"is {out[world, agent]} for agent {agent} in world {world}; it returns finite numbers "
                "(`simulation.read` has NaN for the dead)"
            )
        if self.per == "world":
            out[:] = out.sum(axis=1, keepdims=True)
        elif self.per == "team":
            for team in np.unique(now.team):
                mine = now.team == team
                out[:, mine] = out[:, mine].sum(axis=1, keepdims=True)
        if self.per != "agent":
            out *= now.was_alive


__all__ = [
    "FoundOthers",
    "Situation",
    "Term",
    "alive",
    "captured",
    "captures",
    "closing",
    "collisions",
    "died",
]
