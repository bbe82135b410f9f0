"""The view of world plugins: all rows of all worlds, with methods that change them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from tussle.api.bodies import IN_PLACE, Bodies, BodyView, problems_of_states
from tussle.api.context import Context, stream
from tussle.api.group import GOLDEN, LAWS, GroupView
from tussle.api.mass import MassProperties
from tussle.arguments import explained
from tussle.declare.comms import TopicBuffer
from tussle.declare.messages import Message, Messages
from tussle.errors import MissionError, ParameterError, PluginError, listed, nearest_name
from tussle.numeric import rng
from tussle.numeric.arrays import numbers_below, numbers_of


class WorldBodies(BodyView):
    """The body table of world plugins. health, force and torque are writable; `w.move` changes pos, vel and quat."""

    def __getattr__(self, name: str) -> Any:
        if name in IN_PLACE:
            array = getattr(self._bodies, name)
            if name == "health":
                self.__dict__[name] = array
            else:
                self._bodies.has_loads = True
            return array
        return super().__getattr__(name)


@explained
class WorldView(GroupView):
    """All rows of all worlds. One view is shared by all world plugins.

    It is a `GroupView` over the whole body table: near, nearest, rows_of, pos and so on cover all rows.

    Attributes:
        n_worlds: Number of worlds, including those that have ended, which have no rows.
        t: Time of the visible states [s], (n_worlds,): the end of the step in `step`, the beginning of the step in `start`.
        dt: Time since this plugin's last call in these worlds [s].
        bodies: The body table; health, force and torque are writable.
        teams: Team numbers of the mission, ascending, (n_teams,).
        seeds: Seed of each world, (n_worlds,).
        start_pos: Positions at the start of the step [m], (3, n), for plugins with `reads_start_positions`.
    """

    _called = "w"

    def __init__(self, bodies: Bodies, context: Context) -> None:
        super().__init__(bodies, 0, bodies.n, context, context.clock.dt)
        self.only: np.ndarray | None = None  # worlds this call acts on, (n_worlds,); None for all
        self.table_rows: np.ndarray | None = None  # of a call for some worlds: rows of the whole table, (n,)
        self.failing_world: int | None = None
        self.deaths: list[tuple[np.ndarray, str]] = []
        self.moved: list[np.ndarray] = []
        self.births: list[dict[str, Any]] = []
        self.templates: list[str] = []
        self.start_pos = np.empty((3, 0))
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
        self.context.has_chance = True
        return self.context.seeds

    def team_numbers(self, team: np.ndarray) -> np.ndarray:
        """Index of each team in `teams`: its row in per-team columns.

        Raises:
            ParameterError: The mission has no such team.
        """
        number = np.searchsorted(self.teams, team)
        is_none = np.take(self.teams, number, mode="clip") != team
        if is_none.any():
            wrong = np.atleast_1d(team)[np.atleast_1d(is_none)][0]
            raise ParameterError(f"w.team_numbers: team = {wrong} is not allowed; {self._teams_there()}")
        return number

    def _teams_there(self) -> str:
        return f"the mission has teams {', '.join(map(str, self.teams))}"

    def rows_at(self, world: np.ndarray, ids: np.ndarray) -> np.ndarray:
        """Row of each (world, id), (m,); -1 for id 0 and for removed entities.

        Raises:
            ParameterError: There is no such world, or there are not as many whole numbers as worlds.
        """
        return self._bodies.rows_of(numbers_below(self.n_worlds, world, "rows_at: world"), ids)

    # -- changes ----------------------------------------------------------------------------------------------------------

    def kill(self, rows: Any, why: str) -> np.ndarray:
        """Remove entities at the end of this step, for the reason `why`. Until then they stay visible.

        Args:
            rows: Rows, (m,), or a mask of all rows, (n,).
            why: The reason.

        Returns:
            Whether each of them is removed by this call and not by an earlier one in this step: (m,), or for a mask (n,). Of a row that
            is given twice, the first counts.

        Raises:
            ParameterError: There is no such row; -1, which `rows_of` returns for removed entities, is none.
        """
        given, rows = np.atleast_1d(np.asarray(rows)), self._rows("kill", rows)
        is_new = np.zeros(len(rows), bool)
        is_new[np.unique(rows, return_index=True)[1]] = True
        for before, _ in self.deaths:
            is_new &= ~np.isin(rows, before)
        if len(rows):
            self.deaths.append((rows, why))
        if given.dtype != bool:
            return is_new
        mask = np.zeros(len(given), bool)
        mask[rows] = is_new
        return mask

    def move(
        self,
        rows: Any,
        *,
        pos: np.ndarray | None = None,
        vel: np.ndarray | None = None,
        quat: np.ndarray | None = None,
        omega: np.ndarray | None = None,
    ) -> None:
        """Set pos [m] (3, m), vel [m/s] (3, m), quat (4, m) or omega [rad/s] (3, m) of entities.

        Their motion models continue from the new state. Where it is not finite, or a quaternion has not the length 1, the world ends
        with an error.

        Raises:
            ParameterError: There is no such row, or an array has another shape.
        """
        rows = self._rows("move", rows)
        if not len(rows):
            return
        for name, given, k in (("pos", pos, 3), ("vel", vel, 3), ("quat", quat, 4), ("omega", omega, 3)):
            if given is not None:
                value = numbers_of(given, f"w.move: {name}")
                value = value[:, None] if value.ndim == 1 else value
                if value.ndim != 2 or value.shape[0] != k or value.shape[1] not in (1, len(rows)):
                    raise ParameterError(
                        f"w.move: {name} has shape {value.shape}; it takes ({k}, {len(rows)})"
                    )
                getattr(self._bodies, name)[:, rows] = value
                for item, text in problems_of_states(name, np.broadcast_to(value, (k, len(rows)))):
                    self.fail(rows[item], f"w.move: {text}")
        if self._bodies.scans:
            for row in rows:
                self._bodies.touch(int(row), int(row) + 1)
        else:
            self._bodies.touch(int(rows.min()), int(rows.max()) + 1)
        self.moved.append(rows)

    def mass_properties(self) -> MassProperties:
        """Mass, inertia and weight of all rows, as their motion models use them; `w.mass` is only the mass of their blocks."""
        found = self.context.mass_properties()
        if self.table_rows is None:
            return found
        return MassProperties(
            *(np.take(each, self.table_rows, axis=-1) for each in found)
        )  # contiguous, for kernels

    def spawn(self, block: str, world: Any, **where: Any) -> None:
        """Request new entities of a block, one per item of `world`. They are born at the beginning of the next step.

        Args:
            block: Name of the entity block used as template.
            world: World of each entity, (m,).
            **where: pos [m] (3, m), vel [m/s] (3, m), quat (4, m), team (m,); the block's values by default. Where they are not finite,
                or a quaternion has not the length 1, the world ends with an error.

        Raises:
            MissionError: There is no such block.
            ParameterError: There is no such world, or an array has another name or shape.
        """
        if block not in self.templates:
            raise MissionError(
                f"w.spawn: there is no block {block!r}{nearest_name(block, self.templates)}; {listed(self.templates)}"
            )
        world = numbers_below(self.n_worlds, world, "w.spawn: world")
        full = {name: self._per_birth(name, value, len(world)) for name, value in where.items()}
        kept = self._indices_acted_on(world)
        for name, values in full.items():
            for item, text in problems_of_states(name, values):
                if item in kept:
                    self._fail_world(int(world[item]), f"w.spawn: {text}")
        if len(kept):
            self.births.append(
                {"block": block, "world": world[kept], **{k: v[..., kept] for k, v in full.items()}}
            )

    def _fail_world(self, world: int, why: str) -> None:
        step, plugin = int(self.context.clock.step[world]), self._caller.instance_name
        self.context.fail(world, PluginError(why, step=step, world=world, plugin=plugin))

    def _per_birth(self, name: str, value: Any, m: int) -> np.ndarray:
        allowed = {"pos": (3,), "vel": (3,), "quat": (4,), "team": ()}
        if name not in allowed:
            raise ParameterError(
                f"w.spawn: unknown argument {name!r}{nearest_name(name, allowed)}; {listed(allowed)}"
            )
        values, shape = np.asarray(value, float), (*allowed[name], m)
        values = values[:, None] if allowed[name] and values.ndim == 1 else values
        try:
            values = np.broadcast_to(values, shape)
        except ValueError:
            raise ParameterError(f"w.spawn: {name} has shape {np.shape(value)}; it takes {shape}") from None
        if name == "team" and not np.isin(values, self.teams).all():
            raise ParameterError(f"w.spawn: team = {value!r} is not allowed; {self._teams_there()}")
        return values

    def active_worlds(self) -> list[int]:
        """Numbers of the running worlds that this call acts on."""
        running = self.context.running
        return [int(w) for w in np.flatnonzero(running if self.only is None else running & self.only)]

    def _indices_acted_on(self, world: np.ndarray) -> np.ndarray:
        """Indices of the items of `world`, (m,), that are worlds this call acts on."""
        return np.arange(len(world)) if self.only is None else np.flatnonzero(self.only[world])

    def _rows(self, what: str, rows: Any) -> np.ndarray:
        return numbers_below(self.n, rows, f"w.{what}: rows", ", as of a removed entity,")

    # -- messages ---------------------------------------------------------------------------------------------------------

    def inbox(self, type_: type[Message]) -> Messages:
        """All messages of a type published so far in this step, on any topic, ordered by (world, sender)."""
        if not issubclass(type_, Message):
            raise ParameterError(
                f"w.inbox: {type_!r} is not allowed; it takes a message type, such as EntityCaptured"
            )
        topics = [t for t in self.by_type.get(type_, ()) if t.sent]
        if not topics:
            return Messages.empty(type_)
        return topics[0].outbox() if len(topics) == 1 else Messages.concatenate([t.outbox() for t in topics])

    def publish(self, type_: type[Message], world: Any, network: str = "", **fields: Any) -> None:
        """Publish one message per item of `world` with the world as sender (sender 0).

        Raises:
            ParameterError: There is no such world or field, or a field has another shape.
        """
        world = numbers_below(self.n_worlds, world, "w.publish: world")
        if len(world):
            batch = Messages.make(type_, world, np.zeros(len(world), np.int64), fields)
            self.publish_to(type_, network).add(
                batch if self.only is None else batch.take(self._indices_acted_on(world))
            )

    # -- random numbers and services ------------------------------------------------------------------------------------------------

    def uniform(self, label: str, k: int | None = None) -> np.ndarray:
        """Uniform draws in [0, 1), one per world, (n_worlds,) or (k, n_worlds)."""
        return super().uniform(label, k)

    def normal(self, label: str, k: int | None = None) -> np.ndarray:
        """Standard normal draws, one per world, (n_worlds,) or (k, n_worlds)."""
        return super().normal(label, k)

    def draw_lines(self, law: str, label: str, k: int) -> np.ndarray:
        draw, context, index = self._draw(label), self.context, np.zeros(self.n_worlds, np.int64)
        keys = context.keys
        if context.redraws:
            keys = context.redrawn(keys, draw, np.arange(self.n_worlds), index - 1, index, of_world=True)
        return LAWS[law](keys, stream(*draw), index, context.clock.step, 0, k)

    def uniform_by(self, label: str, world: np.ndarray, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """Uniform draws in [0, 1), (m,), keyed by (world, first, second) and not by position in the arrays.

        `first` is the id of the entity whose luck the draw is, where there is one; a number above it may be in its upper 32 bits.
        """
        return np.asarray(self._keyed(rng.uniform, label, world, first, second, 1)[0])

    def normal_by(
        self, label: str, world: np.ndarray, first: np.ndarray, second: np.ndarray, k: int = 1
    ) -> np.ndarray:
        """Standard normal draws, (k, m), keyed as those of `uniform_by`."""
        return self._keyed(rng.normal, label, world, first, second, k)

    def _keyed(
        self,
        law: Callable[..., np.ndarray],
        label: str,
        world: np.ndarray,
        first: np.ndarray,
        second: np.ndarray,
        k: int,
    ) -> np.ndarray:
        world = numbers_below(self.n_worlds, world, f"worlds of the draw {label!r}")
        first, second = (
            np.atleast_1d(numbers_of(each, f"numbers of the draw {label!r}", "iu"))
            for each in (first, second)
        )
        draw, keys = self._draw(label), self.context.keys[world]
        if self.context.redraws:
            keys = self._redrawn_by(keys, draw, world, first)
        seeds = keys ^ (first.astype(np.uint64) * GOLDEN)
        return law(seeds, stream(*draw), second, self.context.clock.step[world], 0, k)

    def _redrawn_by(
        self, keys: np.ndarray, draw: tuple[str, str], world: np.ndarray, first: np.ndarray
    ) -> np.ndarray:
        """Keys of draws, (m,), with those of re-keys of this plugin, of entities and of blocks."""
        rows = self.rows_at(world, first & (2**32 - 1))
        block, index = np.full((2, len(rows)), -1)
        is_there = rows >= 0
        block[is_there], index[is_there] = self.block[rows[is_there]], self.block_index[rows[is_there]]
        return self.context.redrawn(keys, draw, world, block, index, of_world=True)

    def call(self, service: str, *args: Any, **kwargs: Any) -> Any:
        """Call a service of a world plugin."""
        return self.context.find_service(service, {})(*args, **kwargs)
