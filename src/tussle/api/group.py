"""The view of entity plugins: the rows of one group."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from tussle.api import casting, kernels
from tussle.api.acting import restart, step_some
from tussle.api.bodies import (
    DERIVED,
    EVERYWHERE,
    FLOATS,
    INTS,
    Bodies,
    BodyView,
    CachedArrays,
    derive,
    derived_from,
    read_only,
)
from tussle.api.context import Context, stream
from tussle.api.draw import Draw
from tussle.api.pairs import Nearest, Pairs, find_nearest, find_pairs
from tussle.arguments import Array, explained
from tussle.documents import Whole, check_argument
from tussle.errors import DeclarationError, ParameterError, PluginError, listed, nearest_name
from tussle.numeric import rng
from tussle.numeric.neighbors.index import Index, next_size
from tussle.world.scene import Hits, Scene, TeamRegion

ROWS_PER_THREAD = 4096
"""Minimum number of rows per thread: a kernel takes about 20 ns per row, starting a thread 50 us."""
GOLDEN = np.uint64(0x9E3779B97F4A7C15)
LAWS: dict[str, Callable[..., np.ndarray]] = {"uniform": rng.uniform, "normal": rng.normal}


@explained
class GroupView:
    """Rows [first, last) of the body table: all entities, of all worlds, with the same plugins.

    Row numbers are valid within one call; ids do not change.

    Attributes:
        n: Number of rows.
        first: Row of this view's row 0 in the body table.
        dt: Time since this plugin's last call in these worlds [s]; in the first call, the period of its calls.
        pos: Position [m], (3, n), world frame. Likewise vel [m/s], quat (w, x, y, z), omega [rad/s], force, torque, health, radius,
            mass, and the integers id, team, world, block, block_index. For autonomies and controllers, pos, vel and quat are the
            entity's belief if a sensor writes one.
        motion_state: State of the entity's motion model, (m, n), fields in order of declaration, e.g. to start a rollout from.
    """

    is_subset = False
    _called = "g"  # as hooks name it
    failing_row: int | None

    def __init__(self, bodies: Bodies, first: int, last: int, context: Context, dt: float) -> None:
        self.context = context
        self._period = dt
        self.begin()
        self.failing_row = None
        self._clock_error: np.ndarray | None = None
        self.motion_state: np.ndarray = np.empty((0, 0))
        self._seen: set[str] = set()
        self.services: dict[str, Callable[..., Any]] = {}
        self.belief: dict[str, np.ndarray] = {}
        self.reset(bodies, first, last)

    def own_cache(self) -> None:
        """Call after copying the view, so that both views cache attributes separately."""
        self._seen = set(self._seen)

    def reset(self, bodies: Bodies, first: int, last: int) -> None:
        """Set the rows [first, last), after the table has been repacked."""
        own = self.__dict__
        for name in self._seen:
            own.pop(name, None)
        self._seen.clear()
        self._bodies = bodies
        self._derived: dict[str, CachedArrays] = {}
        self._components: dict[str, tuple[np.ndarray, ...]] = {}
        self.first, self.last = first, last
        self.n = last - first
        self.kept: dict[Any, Any] = {}  # values that hold until rows or parameters change

    def renew(self) -> None:
        """Discard values that depend on seeds and parameters, after rows have been replaced in place."""
        self.__dict__.pop("_seeds", None)
        self.kept.clear()

    def __getattr__(self, name: str) -> Any:
        if name in FLOATS or name in INTS:
            own = self.belief.get(name)
            array = read_only(
                getattr(self._bodies, name)[..., self.first : self.last] if own is None else own
            )
            self.__dict__[name] = array
            self._seen.add(name)
            return array
        if name.startswith("__"):  # queried by `copy`
            raise AttributeError(name)
        if name == "_seeds":
            self._seeds = self.context.row_seeds(self.world, self.block)
            self._seen.add(name)
            return self._seeds
        allowed = [*FLOATS, *INTS, *DERIVED, "t", "dt", "n"]
        every = [*allowed, *(k for k in dir(type(self)) if not k.startswith("_"))]
        raise AttributeError(f"{self._called} has no {name!r}{nearest_name(name, every)}; {listed(allowed)}")

    def _derive(self, name: str) -> np.ndarray:
        kept = self._derived.get(name)
        if kept is None:
            k = DERIVED[name]
            out = np.empty((k, self.n) if k > 1 else self.n)
            kept = self._derived[name] = CachedArrays(-1, (out, read_only(out)))
        bodies = self._bodies
        if "quat" in self.belief:
            derive(name, self.belief["quat"], 0, self.n, 0, kept.columns[0])
        elif kept.version != bodies.version:
            derive(name, bodies.quat, self.first, self.last, self.first, kept.columns[0])
            kept.version = bodies.version
        return kept.columns[1]  # type: ignore[no-any-return]

    def column(self, name: str, rows: np.ndarray | None = None) -> np.ndarray:
        """A body column or derived column by name; the entity's belief if there is one.

        With `rows`, (m,), only of these rows, e.g. of newborn entities in `spawn`.
        """
        if rows is None:
            return self._derive(name) if name in DERIVED else getattr(self, name)
        return derived_from(name, self.quat[:, rows]) if name in DERIVED else getattr(self, name)[..., rows]

    def components(self, name: str) -> tuple[np.ndarray, ...]:
        """Components of a column such as pos, each (n,); for kernels."""
        known = self._components.get(name)
        if known is None:
            known = self._components[name] = tuple(getattr(self, name))
        return known

    @property
    def yaw(self) -> np.ndarray:
        """Heading, counter-clockwise from East [rad], (n,)."""
        return self._derive("yaw")

    @property
    def climb(self) -> np.ndarray:
        """Elevation of the nose, up positive [rad], (n,)."""
        return self._derive("climb")

    @property
    def roll(self) -> np.ndarray:
        """Bank, right wing down positive [rad], (n,)."""
        return self._derive("roll")

    @property
    def forward(self) -> np.ndarray:
        """Unit vector along the body x axis, (3, n), world frame."""
        return self._derive("forward")

    # -- time and surroundings ---------------------------------------------------------------------------------------------------

    @property
    def t(self) -> np.ndarray:
        """Time of the visible states [s], (n,); after motion, the end of the step. With a `clock_error`, that of the clock."""
        self._differs("reads the time")
        t = np.asarray(self.context.clock.at(self.phase)[self.world])
        return t if self._clock_error is None else t + self._clock_error

    @property
    def step_count(self) -> np.ndarray:
        """Step number of each row's world, (n,)."""
        self._differs("reads the time")
        return np.asarray(self.context.clock.step[self.world])

    @property
    def scene(self) -> Scene:
        return self.context.scene

    def region(self, boundary: float) -> TeamRegion:
        """The region with this id, its team and its centre, as a `Boundary` of the mission defines it.

        Raises:
            MissionError: No region, or more than one, has the id.
        """
        return self.context.region(boundary)

    @property
    def draw(self) -> Draw:
        self._differs("draws shapes before `finish`")
        return self.context.draw

    @property
    def bodies(self) -> BodyView:
        """True states of all entities of all groups."""
        return self._bodies.view

    def split(self, kernel: Callable[..., Any], *arguments: Any, least: int = ROWS_PER_THREAD) -> None:
        """Call kernel(*arguments, (first, last)) for parts of the rows, in several threads from 2 * least rows on."""
        if self.context.threads == 1:
            kernel(*arguments, (0, self.n))
        else:
            self.context.split(self.n, lambda *part: kernel(*arguments, part), least)

    def finish(self, function: Callable[[], None]) -> None:
        """Call a function that reads what kernels have written, last in the step of a plugin that `only_calls_kernels`."""
        later, self.context.later = self.context.later, None
        function()
        if later is not None:
            later.append((self, self._caller, function))
            self.context.later = later

    def once(self, function: Callable[..., Any], *parameters: np.ndarray) -> Any:
        """Return function(*parameters), evaluated again only after rows or parameters have changed; for columns of parameters."""
        key = function, id(parameters[0])
        kept = self.kept.get(key)
        if kept is None:
            kept = self.kept[key] = function(*parameters), parameters
        return kept[0]

    def begin(
        self, plugin: Any = None, phase: float = 0.0, dt: float | None = None, substep: int = 0
    ) -> None:
        """Prepare the view for a call of a plugin; by default at the beginning of a step, as for hooks of newborn rows."""
        self._caller, self.phase, self.substep = plugin, phase, substep
        self.dt = self._period if dt is None else dt

    def step(
        self, plugin: Any, active: np.ndarray | None = None, *, clock_error: np.ndarray | None = None
    ) -> None:
        """Step a plugin inside the calling one, with its own random draws.

        With `active`, (n,), only for the rows where it is true: the columns of the others keep their values. With `clock_error` [s], (n,),
        the time that it reads is so much later than the true one, also for plugins inside it.
        """
        if active is not None:
            self._differs(f"steps {type(plugin).__name__} for some rows")
        if clock_error is not None:
            before = self._clock_error
            self._clock_error = clock_error if before is None else before + clock_error
            try:
                self.step(plugin, active)
            finally:
                self._clock_error = before
            return
        caller, self._caller = self._caller, plugin
        if active is None or active.all():
            plugin.step(self)
        elif active.any():
            step_some(plugin, self, active)
        self._caller = caller

    def restart(self, plugin: Any, rows: np.ndarray) -> None:
        """Set the states of a plugin inside the calling one to those of new entities, for some rows, (m,)."""
        if len(rows):
            caller, self._caller = self._caller, plugin
            restart(plugin, self, rows)
            self._caller = caller

    def fail(self, row: int, why: str) -> None:
        """End the world of a row with an error at the end of this step; other worlds continue. For plugins with handles."""
        world = int(self.world[row])
        step, plugin = int(self.context.clock.step[world]), self._caller.instance_name
        name = self.context.block_names[int(self.block[row])]
        self.context.fail(
            world,
            PluginError(why, where=f"{name} {int(self.id[row])}", step=step, world=world, plugin=plugin),
        )

    def who(self, row: int) -> str:
        """Block, id and world of a row, for messages."""
        check_argument("who: row", row, Whole(0, self.n - 1))
        name = self.context.block_names[int(self.block[row])]
        return f"{name} {int(self.id[row])} of world {int(self.world[row])}"

    # -- other entities -----------------------------------------------------------------------------------------------------------

    @property
    def born(self) -> np.ndarray:
        """Step of its world in which each entity was born, (n,); for inboxes."""
        return self._bodies.born[self.first : self.last]

    def bodies_rows(self, world: np.ndarray, ids: np.ndarray) -> np.ndarray:
        return self._bodies.rows_of(world, ids)

    def rows_of(self, ids: np.ndarray) -> np.ndarray:
        """Rows in `bodies` of the entities with these ids, (n,), in the worlds of the rows; -1 for id 0 and removed entities.

        Raises:
            ParameterError: The ids are not whole numbers, or of another shape.
        """
        return self._bodies.rows_of(self.world, ids)

    def reach(self, radius: float | np.ndarray, is_constant: bool = False) -> float | np.ndarray:
        """Reach of an index for a radius, one number or (n,) [m]: a float if equal in all worlds, otherwise (n_worlds,).

        It is the longest radius of the world if that is constant, as parameters are. Otherwise it is the next one of a few sizes:
        a radius that changes does not need another index at each call.
        """
        if not isinstance(radius, np.ndarray):
            return float(radius) if is_constant else float(next_size(radius))
        known: tuple[np.ndarray, float | np.ndarray] | None = self.kept.get(id(radius))
        if known is not None:
            return known[1]
        longest = np.zeros(self._bodies.n_worlds)
        common = kernels.longest_reach(radius, self.world, longest)
        if is_constant or not radius.flags.writeable:
            reach = longest if common < 0.0 else float(common)
        elif common < 0.0:
            sizes = next_size(longest)
            reach = float(sizes[0]) if (sizes == sizes[0]).all() else sizes
        else:
            reach = float(next_size(common))
        if not radius.flags.writeable:  # a parameter
            self.kept[id(radius)] = radius, reach
        return reach

    def index(self, radius: float | np.ndarray) -> Index:
        """Neighbour index for queries within radius [m], one number or (n,); for kernels."""
        if self._bodies.scans:
            return self._bodies.index(EVERYWHERE)
        if self.context.threads == 1:
            return self._bodies.index(self.reach(radius))
        return self._bodies.index(self.reach(radius), self.split_rows)

    def range_points(self, index: Index) -> np.ndarray:
        """Positions by place that decide who is in range [m], (3, N + 8); with update="sequential" those at the start of the step."""
        return self._bodies.range_points(index)

    def split_rows(self, n: int, run: Callable[[int, int], Any]) -> None:
        """Call run(first, last) for parts of n rows in several threads."""
        self.context.split(n, run, ROWS_PER_THREAD)

    def any_index(self) -> Index:
        """Neighbour index for searches without a radius; for kernels."""
        return self._bodies.any_index()

    @property
    def one_per_world(self) -> bool:
        """True if each row is in a different world, since entities move one after another."""
        return self._bodies.scans

    def by_place(self, index: Index, name: str) -> tuple[np.ndarray, ...]:
        """Components of a body column of all entities, by place of an index; for kernels."""
        if self.context.threads == 1:
            return self._bodies.by_place(index, name)
        return self._bodies.by_place(index, name, self.split_rows)

    def near(self, radius: float | np.ndarray, teams: str | int | None = None) -> Pairs:
        """Pairs of a row and another entity of its world at a distance < radius.

        With update="sequential", the positions at the start of the step decide which entities are in range of an autonomy or controller.

        Args:
            radius: One number or (n,) [m].
            teams: "own", "other", a team number, or None for all.

        Raises:
            ParameterError: A value or a shape is not allowed.
        """
        radius = self._checked_radius(radius)
        index, rows = self.index(radius), (self.first, self.last)
        return find_pairs(index, self.range_points(index), rows, self.pos, radius, teams, self.bodies)

    def _checked_radius(self, radius: Any) -> float | np.ndarray:
        array = np.asarray(radius)
        if (
            array.dtype.kind not in "iuf"
            or array.shape not in ((), (self.n,))
            or (array.dtype.kind == "f" and np.isnan(array).any())
        ):
            given = f"{radius!r:.60}" if array.ndim == 0 else f"an array of {array.dtype}, {array.shape}"
            raise ParameterError(
                f"near: radius = {given} is not allowed; it takes a number, or numbers ({self.n},)"
            )
        if isinstance(radius, np.ndarray) and array.ndim:
            return radius if array.dtype == float else array.astype(float)
        return np.array(array, float) if array.ndim else float(array)

    def nearest(
        self, k: int = 1, teams: str | int | np.ndarray | None = None, among: np.ndarray | None = None
    ) -> Nearest:
        """The k nearest other entities of each row, at any distance.

        Args:
            k: Number of entities.
            teams: As in `near`, or one team per row, (n,).
            among: Instead of `teams`: the rows of `bodies` to choose from, a boolean mask, (N,).

        Raises:
            ParameterError: Both `teams` and `among` are given, or a value is not allowed.
        """
        check_argument("nearest: k", k, Whole(1))
        if isinstance(teams, np.ndarray) and teams.shape != (self.n,):
            raise ParameterError(
                f"nearest: teams = an array {teams.shape} is not allowed; it takes ({self.n},)"
            )
        return find_nearest(self._bodies, (self.first, self.last), self.pos, k, teams, among)

    def cast(
        self, origins: Array, directions: Array, max_range: Array = np.inf, *, row: np.ndarray | None = None,
        world: np.ndarray | None = None, entities: bool = True,
    ) -> Hits:  # fmt: skip
        """The first hits of rays on the scene and on the other entities: spheres of their radius, or boxes where the block has one.

        Args:
            origins: Where the rays begin [m], (3, m), world frame.
            directions: Where they go, of any length, (3, m).
            max_range: Hits further away do not count [m], one number or (m,).
            row: Row of the entity that casts each ray, (m,), which the ray does not meet; by default one ray for each row.
            world: Instead of `row`: world of each ray, (m,), which may meet all entities.
            entities: Whether rays meet entities.

        Raises:
            ParameterError: A shape does not fit, or a value is not allowed.
        """
        rays = origins, directions, max_range
        return casting.cast(self.context, self._bodies, rays, *self._askers(row, world), entities)

    def _askers(self, row: np.ndarray | None, world: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
        """World of each ray or place, and row of the entity that it does not meet, -1 for none."""
        if world is None:
            rows = np.arange(self.n) if row is None else np.asarray(row)
            return self.world[rows], self.first + rows
        return np.asarray(world), np.full(len(world), -1)

    def height(
        self, x: Array, y: Array, *, row: np.ndarray | None = None, world: np.ndarray | None = None
    ) -> np.ndarray:
        """Height of the highest surface at places x, y [m], (m,): of the scene, or of another entity; -inf where there is none.

        `row` and `world` are as for `cast`.

        Raises:
            ParameterError: A shape does not fit, or a value is not allowed.
        """
        return casting.height(self.context, self._bodies, x, y, *self._askers(row, world))

    def free(
        self, points: Array, radius: Array, *, row: np.ndarray | None = None, world: np.ndarray | None = None
    ) -> np.ndarray:
        """Return True if spheres round points [m], (3, m), touch neither the scene nor another entity, and lie inside of none, (m,).

        A mesh of the scene is a surface: a point that it surrounds is free. `row` and `world` are as for `cast`.

        Args:
            points: Centres, world frame.
            radius: One number or (m,) [m].
            row: Row of the entity that does not count.
            world: Instead of `row`: world of each point.

        Raises:
            ParameterError: A shape does not fit, or a value is not allowed.
        """
        return casting.free(self.context, self._bodies, points, radius, *self._askers(row, world))

    def is_clear(
        self, a: Array, b: Array, *, row: np.ndarray | None = None, world: np.ndarray | None = None
    ) -> np.ndarray:
        """Return True if neither the scene nor another entity lies between points a and b [m], (3, m) each; (m,).

        `row` and `world` are as for `cast`.

        Raises:
            ParameterError: A shape does not fit, or a value is not allowed.
        """
        way = np.asarray(b, float) - np.asarray(a, float)
        x, y, z = way
        hits = self.cast(a, way, np.sqrt(x * x + y * y + z * z), row=row, world=world)
        return np.asarray(hits.distance == np.inf)

    def line_of_sight(self, row: np.ndarray, other: np.ndarray, entities: bool = True) -> np.ndarray:
        """Return True if nothing lies between entities: on the line between their centres, outside of their spheres of `radius`.

        Args:
            row: Rows of the view, (m,), as `near.row`.
            other: Rows of the body table, (m,), as `near.other`.
            entities: Whether entities hide others, and not only the scene.

        Returns:
            (m,)
        """
        bodies = self._bodies
        offset = bodies.pos[:, other] - self.pos[:, row]
        x, y, z = offset
        distance, own = np.sqrt(x * x + y * y + z * z), self.radius[row]
        gap = distance - own - bodies.radius[other]
        is_apart = gap > 0.0
        way = np.where(is_apart, offset, 0.0)
        start = self.pos[:, row] + way * np.where(is_apart, own / np.where(is_apart, distance, 1.0), 0.0)
        hits = self.cast(start, way, np.where(is_apart, gap, 0.0), row=row, entities=entities)
        return np.asarray((hits.distance == np.inf) | (hits.id == bodies.id[other]))

    # -- random numbers and services ------------------------------------------------------------------------------------------------

    def _differs(self, what: str, label: str = "") -> None:
        """Refuse what differs from step to step where the calls of kernels are recorded."""
        if self.context.later is not None:
            named = f" {label!r}" if label else ""
            raise DeclarationError(
                f"{type(self._caller).__name__} promises only_calls_kernels, but {what}{named}"
            )

    def _draw(self, label: str) -> tuple[str, str]:
        """Plugin and label of a draw, noted as drawn."""
        self._differs("draws", label)
        draw = self._caller.instance_name if self._caller is not None else "", label
        self.context.streams.add(draw)
        self.context.has_chance = True
        return draw

    def _keyed_seeds(self, draw: tuple[str, str]) -> np.ndarray:
        """Random key of each row for a draw, (n,)."""
        if not self.context.redraws:
            return self._seeds
        return self.context.redrawn(self._seeds, draw, self.world, self.block, self.block_index)

    def uniform(self, label: str, k: int | None = None) -> np.ndarray:
        """Uniform draws in [0, 1), (n,) or (k, n); an entity's draws do not depend on other entities."""
        out = self.draw_lines("uniform", label, 1 if k is None else k)
        return out if k is not None else out[0]

    def normal(self, label: str, k: int | None = None) -> np.ndarray:
        """Standard normal draws, (n,) or (k, n)."""
        out = self.draw_lines("normal", label, 1 if k is None else k)
        return out if k is not None else out[0]

    def draw_lines(self, law: str, label: str, k: int) -> np.ndarray:
        """The draws of `uniform` and `normal`, (k, n); for easy mode."""
        draw = self._draw(label)
        return LAWS[law](
            self._keyed_seeds(draw), stream(*draw), self.block_index, self.step_count, self.substep, k
        )

    def uniform_pairs(self, label: str, near: Any, k: int | None = None) -> np.ndarray:
        """Uniform draws in [0, 1), one per pair of `near`, (m,) or (k, m); a pair's draws do not depend on other entities.

        A draw is keyed by the entity of the row, the id of the other and the step.
        """
        return self._of_pairs(rng.uniform, label, near, k)

    def normal_pairs(self, label: str, near: Any, k: int | None = None) -> np.ndarray:
        """Standard normal draws, one per pair of `near`, (m,) or (k, m); as `uniform_pairs`."""
        return self._of_pairs(rng.normal, label, near, k)

    def _of_pairs(self, law: Callable[..., np.ndarray], label: str, near: Any, k: int | None) -> np.ndarray:
        row, clock, draw = near.row, self.context.clock, self._draw(label)
        seeds = self._keyed_seeds(draw)[row] ^ (self.bodies.id[near.other].astype(np.uint64) * GOLDEN)
        step = clock.step[self.world[row]]
        out = law(seeds, stream(*draw), self.block_index[row], step, self.substep, 1 if k is None else k)
        return out if k is not None else out[0]

    def call(self, service: str, *args: Any, **kwargs: Any) -> Any:
        """Call a service of the entity's plugins, with this view as first argument, or of the world plugins."""
        self._differs("calls the service", service)
        function = self.context.find_service(service, self.services)
        return function(self, *args, **kwargs) if service in self.services else function(*args, **kwargs)
