"""What a world plugin sees: all rows of all worlds, and the means to change them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from tussle import rng
from tussle.api.bodies import Bodies, BodyView
from tussle.api.context import Context
from tussle.api.group import GOLDEN, LAWS, GroupView
from tussle.comms import TopicBuffer
from tussle.errors import MissionError, ParameterError, listed, nearest_name
from tussle.messages import Message, Messages

WRITABLE = ("health", "force", "torque")


class WorldBodies(BodyView):
    """The body table of a world plugin: health, force and torque are writable; pos, vel and quat change through `w.move`."""

    def __getattr__(self, name: str) -> Any:
        if name in WRITABLE:
            array = getattr(self._bodies, name)
            self.__dict__[name] = array
            return array
        return super().__getattr__(name)


class WorldView(GroupView):
    """All rows of all worlds; one view serves all world plugins.

    It is a `GroupView` over the whole table (near, nearest, rows_of, pos ... over all rows) with these beside it.

    Attributes:
        n_worlds: Number of worlds, ended ones included; these have no rows.
        t: Time of the states that are seen [s], (n_worlds,): in `step` that of the step's end, in `start` that of its beginning.
        dt: Time since this plugin's last call in these worlds [s].
        bodies: The table; health, force and torque are writable.
        teams: Team numbers of the mission, ascending, (n_teams,).
        seeds: Seed of each world, (n_worlds,).
    """

    def __init__(self, bodies: Bodies, context: Context) -> None:
        super().__init__(bodies, 0, bodies.n, context, context.clock.dt)
        self.only: np.ndarray | None = None  # worlds that this view speaks for, (n_worlds,); None is all
        self.failing_world: int | None = None
        self.deaths: list[tuple[np.ndarray, str]] = []
        self.moved: list[np.ndarray] = []
        self.births: list[dict[str, Any]] = []
        self.templates: list[str] = []
        self.by_type: dict[type[Message], list[TopicBuffer]] = {}
        self.publish_to: Callable[[type[Message], str], TopicBuffer]

    def reset(self, bodies: Bodies, first: int, last: int) -> None:
        super().reset(bodies, first, last)
        self.n_worlds = bodies.n_worlds
        self._writable = WorldBodies(bodies)

    @property
    def bodies(self) -> WorldBodies:
        return self._writable

    @property
    def t(self) -> np.ndarray:
        return self.context.clock.at(self.phase)

    @property
    def step_count(self) -> np.ndarray:
        return self.context.clock.step

    @property
    def teams(self) -> np.ndarray:
        return self.context.teams

    @property
    def seeds(self) -> np.ndarray:
        return self.context.seeds

    def team_numbers(self, team: np.ndarray) -> np.ndarray:
        """Place of each team in `teams`, for per-team columns."""
        return np.searchsorted(self.teams, team)

    def rows_at(self, world: np.ndarray, ids: np.ndarray) -> np.ndarray:
        """Row of each (world, id), (m,); -1 for id 0 and for those that are gone."""
        return self._bodies.rows_of(np.ascontiguousarray(world, np.int64), ids)

    # -- changes ----------------------------------------------------------------------------------------------------------

    def kill(self, rows: Any, why: str) -> None:
        """Remove entities at the end of this step; others still see them until then."""
        rows = self._rows(rows)
        if len(rows):
            self.deaths.append((rows, why))

    def move(
        self,
        rows: Any,
        *,
        pos: np.ndarray | None = None,
        vel: np.ndarray | None = None,
        quat: np.ndarray | None = None,
    ) -> None:
        """Put entities elsewhere: pos [m], vel [m/s], (3, m), quat, (4, m); their motion models take it over."""
        rows = self._rows(rows)
        if not len(rows):
            return
        for name, given, k in (("pos", pos, 3), ("vel", vel, 3), ("quat", quat, 4)):
            if given is not None:
                value = np.asarray(given, float)
                value = value[:, None] if value.ndim == 1 else value
                if value.shape[0] != k or value.shape[1] not in (1, len(rows)):
                    raise ParameterError(
                        f"w.move: {name} has shape {value.shape}; needed is ({k}, {len(rows)})"
                    )
                getattr(self._bodies, name)[:, rows] = value
        for row in rows:
            self._bodies.touch(int(row), int(row) + 1)
        self.moved.append(rows)

    def spawn(self, block: str, world: Any, **where: Any) -> None:
        """Ask for new entities of a block, one per item of `world`; they appear at the beginning of the next step.

        Args:
            block: Name of the entity block that serves as template.
            world: World of each, (m,).
            **where: pos, vel (3, m), quat (4, m), team (m,); what is missing is the block's.
        """
        if block not in self.templates:
            raise MissionError(
                f"w.spawn: there is no block {block!r}{nearest_name(block, self.templates)}; {listed(self.templates)}"
            )
        world = np.atleast_1d(np.asarray(world, np.int64))
        full = {name: self._per_birth(name, value, len(world)) for name, value in where.items()}
        kept = self._spoken_for(world)
        if len(kept):
            self.births.append(
                {"block": block, "world": world[kept], **{k: v[..., kept] for k, v in full.items()}}
            )

    def _per_birth(self, name: str, value: Any, m: int) -> np.ndarray:
        allowed = {"pos": (3,), "vel": (3,), "quat": (4,), "team": ()}
        if name not in allowed:
            raise ParameterError(f"w.spawn: unknown {name!r}{nearest_name(name, allowed)}; {listed(allowed)}")
        values, shape = np.asarray(value, float), (*allowed[name], m)
        values = values[:, None] if allowed[name] and values.ndim == 1 else values
        try:
            values = np.broadcast_to(values, shape)
        except ValueError:
            raise ParameterError(f"w.spawn: {name} has shape {np.shape(value)}; needed is {shape}") from None
        if name == "team" and not np.isin(values, self.teams).all():
            raise ParameterError(
                f"w.spawn: team = {value!r} is not allowed; teams of the mission are {', '.join(map(str, self.teams))}"
            )
        return values

    def spoken_for(self) -> list[int]:
        """Numbers of the worlds that run and that this view speaks for."""
        running = self.context.running
        return [int(w) for w in np.flatnonzero(running if self.only is None else running & self.only)]

    def _spoken_for(self, world: np.ndarray) -> np.ndarray:
        """Which of these worlds this view speaks for: all, but for a call on behalf of some."""
        return np.arange(len(world)) if self.only is None else np.flatnonzero(self.only[world])

    def _rows(self, rows: Any) -> np.ndarray:
        rows = np.atleast_1d(np.asarray(rows))
        return np.flatnonzero(rows) if rows.dtype == bool else rows.astype(np.int64)

    # -- messages ---------------------------------------------------------------------------------------------------------

    def inbox(self, type_: type[Message]) -> Messages:
        """All messages of a type published so far in this step, whatever their topic, ordered by (world, sender)."""
        topics = [t for t in self.by_type.get(type_, ()) if t.sent]
        if not topics:
            return Messages.empty(type_)
        return topics[0].outbox() if len(topics) == 1 else Messages.concatenate([t.outbox() for t in topics])

    def publish(self, type_: type[Message], world: Any, network: str = "", **fields: Any) -> None:
        """Send one message per item of `world` in the name of the world (sender 0)."""
        world = np.atleast_1d(np.asarray(world, np.int64))
        if len(world):
            batch = Messages.make(type_, world, np.zeros(len(world), np.int64), fields)
            self.publish_to(type_, network).add(
                batch if self.only is None else batch.take(self._spoken_for(world))
            )

    # -- chance and services ------------------------------------------------------------------------------------------------

    def uniform(self, label: str, k: int | None = None) -> np.ndarray:
        """Uniform draws in [0, 1), one per world, (n_worlds,) or (k, n_worlds)."""
        return super().uniform(label, k)

    def normal(self, label: str, k: int | None = None) -> np.ndarray:
        """Standard normal draws, one per world, (n_worlds,) or (k, n_worlds)."""
        return super().normal(label, k)

    def draw_lines(self, law: str, label: str, k: int) -> np.ndarray:
        clock, index = self.context.clock, np.zeros(self.n_worlds, np.int64)
        return LAWS[law](self.context.seeds, self._stream(label), index, clock.step, 0, k)

    def uniform_by(self, label: str, world: np.ndarray, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """Uniform draws in [0, 1), one per (world, first, second), (m,): keyed by these numbers, not by their place."""
        seeds = self.context.seeds[world] ^ (first.astype(np.uint64) * GOLDEN)
        draws = rng.uniform(seeds, self._stream(label), second, self.context.clock.step[world], 0, 1)
        return np.asarray(draws[0])

    def call(self, service: str, *args: Any, **kwargs: Any) -> Any:
        """Call a service of a world plugin."""
        return self.context.find_service(service, {})(*args, **kwargs)
