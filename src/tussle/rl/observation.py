"""Observations of agents: components, each a few numbers side by side."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby
from typing import TYPE_CHECKING, Any

import numpy as np

from tussle.api.bodies import FLOATS, OFFSETS
from tussle.api.kinds import row_shape
from tussle.documents import Whole, check_argument
from tussle.errors import ParameterError, listed, nearest_name
from tussle.numeric.kernel import kernel
from tussle.numeric.neighbors.index import padded
from tussle.numeric.neighbors.lane_count import LANES
from tussle.numeric.neighbors.search import ANY, DIFFERENT, SAME
from tussle.rl import kernels
from tussle.rl.features import (
    FRAMES,
    LIMITS,
    OTHERS,
    OWN,
    RELATIVE,
    VECTORS,
    Scale,
    Spec,
    bounds_of,
    check_features,
    factor_of,
    of_others,
    scalars,
    span,
    spans_of_others,
    spec_of,
)
from tussle.rl.searches import SharedSearches

if TYPE_CHECKING:
    from tussle.engine.group import Group
    from tussle.engine.simulation import Simulation
    from tussle.mission import Mission

TEAMS = ("own", "other")
WHOLE_WORLD = 500
"""Up to this many entities, the nearest others are looked for among all of a world."""
WRITERS = {
    np.dtype(dtype): {
        law.__name__: kernel(f"{signature} {out}")(law) for law, signature in kernels.SIGNATURES.items()
    }
    for dtype, out in ((np.float32, "S2w"), (np.float64, "F2w"))
}
"""The kernels of observations by type of the numbers and by name."""


@dataclass(frozen=True)
class AgentRows:
    """Agents of one block in one group.

    Attributes:
        block: Name of the block.
        group: The group that holds their rows.
        rows: Rows of the body table, (m,).
        agents: Number of each agent: world * agents per world + place in its world, (m,).
        team: Team of each as a float, (m,).
        kept: What components keep until rows change.
        span: All agents of the block in this group have rows from span[0] to span[1] - 1, though `rows` may be some of them.
        searches: What searches share and keep; None where nothing is kept.
    """

    block: str
    group: Group
    rows: np.ndarray
    agents: np.ndarray
    team: np.ndarray
    kept: dict[Any, Any]
    span: tuple[int, int]
    searches: SharedSearches | None = None


class Component(ABC):
    """A part of an observation; abstract."""

    @abstractmethod
    def width(self, mission: Mission, block: str) -> int:
        """Return the number of values that agents of a block observe; check the declaration.

        Raises:
            ParameterError: A name or value is not allowed.
        """

    @abstractmethod
    def write(self, simulation: Simulation, part: AgentRows, column: int, out: np.ndarray) -> None:
        """Write the numbers of a part's agents to out, (agents, numbers), from `column` on."""

    def bounds(self, mission: Mission, block: str) -> np.ndarray:
        """Smallest and largest value of each number, (2, width), infinite where they are not known; 0 is always between them.

        They follow from the declaration alone, so that they hold for all parameters. Values are not clipped.
        """
        return np.repeat([[-np.inf], [np.inf]], self.width(mission, block), axis=1)


@dataclass(frozen=True)
class Own(Component):
    """Columns of the agent itself.

    Attributes:
        columns: Names, separated by spaces: body columns, "forward", or columns of its plugins, "Unicycle.x".
        scale: Values are divided by it; one number, or one per name.
        frame: Frame of vectors: "world", "heading" (turned by the heading) or "body".
        origin: Point that `pos` is relative to [m].
        planar: Vectors have two components.
    """

    columns: str
    scale: Scale = 1.0
    frame: str = "world"
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    planar: bool = False

    def width(self, mission: Mission, block: str) -> int:
        names = self.columns.split()
        check_features("Own", self.frame, names, OWN, self.scale)
        owner = next(b for b in mission.blocks if b.name == block)
        total = 0
        for name in names:
            if "." in name:
                total += _column_of(owner, name)
            else:
                k = 3 if name == "forward" else FLOATS[name]
                total += 2 if k == 3 and self.planar and name != "forward" else k
        return total

    def bounds(self, mission: Mission, block: str) -> np.ndarray:
        owner = next(b for b in mission.blocks if b.name == block)
        spans: list[tuple[float, float]] = []
        for name in self.columns.split():
            width = _column_of(owner, name) if "." in name else self._lines(name)[1]
            spans += span(*LIMITS.get(name, (-np.inf, np.inf)), factor_of(self.scale, name), width)
        return bounds_of(spans)

    @cached_property
    def _parts(self) -> list[tuple[str, Spec, int]]:
        """Return the parts that are written with one call: a plugin's column, or "" for adjacent body columns; spec; number of columns."""
        parts: list[tuple[str, Spec, int]] = []
        for is_plugin, names in groupby(self.columns.split(), lambda name: "." in name):
            if is_plugin:
                parts += [(name, spec_of([]), 0) for name in names]
            else:
                found: list[tuple[float, ...]] = []
                width = 0
                for name in names:
                    lines, k = self._lines(name)
                    found, width = found + lines, width + k
                parts.append(("", spec_of(found), width))
        return parts

    def _lines(self, name: str) -> tuple[list[tuple[float, ...]], int]:
        """The features of a body column, and its number of columns."""
        factor = factor_of(self.scale, name)
        if name == "forward":
            return [(kernels.FORWARD, 0, factor, 0.0, 0.0, 0.0)], 3
        if name in VECTORS:
            kind, width = (kernels.PLANE, 2) if self.planar else (kernels.SPACE, 3)
            point = self.origin if name == "pos" else (0.0, 0.0, 0.0)
            return [(kind, OFFSETS[name], factor, *point)], width
        return scalars(OFFSETS[name], FLOATS[name], factor), FLOATS[name]

    def write(self, simulation: Simulation, part: AgentRows, column: int, out: np.ndarray) -> None:
        floats, own = simulation.state.population.bodies.floats, WRITERS[out.dtype]["own"]
        who = part.rows, part.agents
        for name, spec, width in self._parts:
            if name:
                column = self._write_plugin_column(name, part, floats, column, out)
                continue
            own(floats, floats, 0, who, spec, FRAMES[self.frame], column, out)
            column += width

    def _write_plugin_column(
        self, name: str, part: AgentRows, floats: np.ndarray, column: int, out: np.ndarray
    ) -> int:
        """Write a column of a plugin. Returns the next column."""
        table, shift, first, width = _plugin_column(part.group, name)
        spec, who = spec_of(scalars(first, width, factor_of(self.scale, name))), (part.rows, part.agents)
        WRITERS[out.dtype]["own"](floats, table, shift, who, spec, FRAMES[self.frame], column, out)
        return column + width


def _column_of(block: Any, path: str) -> int:
    """Number of components of a plugin's column."""
    from tussle.declare.columns import Numbers

    plugin, _, name = path.partition(".")
    plugins = {p.instance_name: p for p in block.plugins}
    if plugin not in plugins:
        raise ParameterError(
            f"Own: {path!r}: {block.name} has no {plugin!r}{nearest_name(plugin, plugins)}; {listed(plugins)}"
        )
    columns = {k: c for k, c in type(plugins[plugin]).declared(Numbers).items() if not c.ragged}
    if name not in columns:
        raise ParameterError(f"Own: {plugin} has no {name!r}{nearest_name(name, columns)}; {listed(columns)}")
    return max(1, sum(row_shape(plugins[plugin], columns[name])))


def _plugin_column(group: Group, path: str) -> tuple[np.ndarray, int, int, int]:
    """Table of a plugin's column, body row of its first column, row in the table, and number of rows."""
    plugin, _, name = path.partition(".")
    binding = next(b for b in group.walk() if b.path == (plugin,))
    binding.check_is_written(name, f"Own: {path!r}")
    place = binding.places[name]
    table = np.ascontiguousarray(group.table.arrays[place.dtype], float)
    return table, group.first, place.first, max(1, place.k)


def block_numbers(mission: Mission, names: str) -> list[int]:
    """Places in a mission of blocks whose names are separated by spaces."""
    return [i for i, b in enumerate(mission.blocks) if b.name in names.split()]


class _Others(Component):
    """Others whose columns are observed; abstract."""

    columns: str
    scale: Scale
    planar: bool

    @cached_property
    def _features(self) -> tuple[Spec, int]:
        return of_others(self.columns.split(), self.scale, self.planar)


def _split_of(simulation: Simulation) -> Any:
    """Return the function that splits rows over several threads; None with one thread."""
    state = simulation.state
    return None if state.context.threads == 1 else state.world_view.split_rows


class _Search(_Others):
    """Others that are looked for; abstract.

    Attributes:
        of: Whom: "own" or "other" team, a team number, names of blocks, separated by spaces, or None for all.
        radius: Those further away do not count [m].
    """

    of: str | int | None

    def _wanted(self, part: AgentRows, simulation: Simulation) -> tuple[int, np.ndarray]:
        """Mode of the search, and what each agent looks for: a team, or a value of `_classes`."""
        of = self.of
        if of is None:
            return ANY, part.team
        if isinstance(of, str) and of not in TEAMS:
            numbers = block_numbers(simulation.mission, of)
            return SAME, np.full(len(part.team), float(numbers[0]) if len(numbers) == 1 else 1.0)
        if isinstance(of, int):
            return SAME, np.full(len(part.team), float(of))
        return (SAME if of == "own" else DIFFERENT), part.team

    def _classes(self, simulation: Simulation, index: Any, split: Any) -> np.ndarray:
        """What is looked for by place of an index, (N,): teams; of one block, blocks; of several, 1 for theirs."""
        bodies, of = simulation.state.population.bodies, self.of
        if not isinstance(of, str) or of in TEAMS:
            return bodies.by_place(index, "team", split)[0]
        blocks, numbers = bodies.by_place(index, "block", split)[0], block_numbers(simulation.mission, of)
        if len(numbers) == 1:
            return blocks
        found = padded(len(blocks))
        found[:] = np.isin(blocks, numbers)
        return found

    def _check_of(self, mission: Mission, radius: float, needs_radius: bool) -> None:
        of, name = self.of, type(self).__name__
        if isinstance(of, str) and of not in TEAMS:
            known = [b.name for b in mission.blocks]
            for block in of.split() or [""]:
                if block not in known:
                    raise ParameterError(
                        f"{name}: of = {of!r}: there is no block {block!r}{nearest_name(block, [*known, *TEAMS])}; "
                        f"it takes 'own', 'other', a team number, None, or names of blocks; {listed(known)}"
                    )
        if isinstance(of, int) and of not in (teams := sorted({b.team for b in mission.blocks})):
            raise ParameterError(f"{name}: of = {of}: there is no such team; {listed(map(str, teams))}")
        if not radius > 0.0 or (needs_radius and radius == np.inf):
            raise ParameterError(f"{name}: radius = {radius!r} is not allowed; it takes a number > 0")

    def _index(
        self, simulation: Simulation, reach: float, is_whole: bool = False
    ) -> tuple[Any, tuple[np.ndarray, ...], tuple[np.ndarray, ...]]:
        bodies, split = simulation.state.population.bodies, _split_of(simulation)
        if is_whole:
            reach = np.inf
        index = bodies.any_index() if reach == np.inf and not is_whole else bodies.index(reach, split)
        places = index.row_world, index.place, index.order
        return bodies.floats, places, (*index.table, self._classes(simulation, index, split))


@dataclass(frozen=True)
class NearestOthers(_Search):
    """The k nearest others, nearest first; zeros where there are fewer.

    Attributes:
        k: How many.
        columns: Names, separated by spaces: "offset" and "relative_vel", relative to the agent; "distance"; "direction", the unit
            vector to it; "same_team" and "present", 1 or 0; body columns.
        of: Whom: "own" or "other" team, a team number, names of blocks, separated by spaces, or None for all.
        radius: Those further away do not count [m].
        scale: As in `Own`, like frame and planar.
    """

    k: int
    columns: str = "offset relative_vel same_team present"
    of: str | int | None = None
    radius: float = np.inf
    scale: Scale = 1.0
    frame: str = "heading"
    planar: bool = False

    def width(self, mission: Mission, block: str) -> int:
        names = self.columns.split()
        check_features("NearestOthers", self.frame, names, (*RELATIVE, *OTHERS, *FLOATS), self.scale)
        self._check_of(mission, self.radius, False)
        check_argument("NearestOthers: k", self.k, Whole(1))
        return self.k * self._features[1]

    def bounds(self, mission: Mission, block: str) -> np.ndarray:
        return bounds_of(self.k * spans_of_others(self.columns.split(), self.scale, self.planar, self.radius))

    def write(self, simulation: Simulation, part: AgentRows, column: int, out: np.ndarray) -> None:
        bodies = simulation.state.population.bodies
        is_small = bodies.n <= WHOLE_WORLD * simulation.n_worlds
        mode, wanted = self._wanted(part, simulation)
        numbers = self.k, mode, FRAMES[self.frame], column, self._features[1]
        if self.k > LANES or (self.radius == np.inf and not is_small):
            self._write_apart(simulation, part, wanted, numbers, out)
        elif is_small and part.searches is not None:
            self._write_found(simulation, part, wanted, numbers, out)
        else:
            reach = np.inf if is_small else self.radius
            self._write_blocks(simulation, part, wanted, numbers, reach, out)

    def _write_found(
        self,
        simulation: Simulation,
        part: AgentRows,
        wanted: np.ndarray,
        numbers: tuple[int, ...],
        out: np.ndarray,
    ) -> None:
        bodies, split = simulation.state.population.bodies, simulation.state.context.split
        _, places, arrays = self._index(simulation, np.inf, is_whole=True)
        who, search = (part.rows, part.agents), (self.k, numbers[1], self.radius)
        assert part.searches is not None
        near = part.searches.nearest(bodies, self.of, (*who, wanted), places, arrays, search, split)
        write, spec = WRITERS[out.dtype]["found"], self._features[0]
        split(
            len(part.rows),
            lambda *some: write(
                bodies.floats, who, bodies.team, near, spec, (self.k, *numbers[2:]), some, out
            ),
        )

    def _write_apart(
        self,
        simulation: Simulation,
        part: AgentRows,
        wanted: np.ndarray,
        numbers: tuple[int, ...],
        out: np.ndarray,
    ) -> None:
        floats, places, arrays = self._index(simulation, np.inf)
        who, team = (part.rows, part.agents), simulation.state.population.bodies.team
        write, spec = WRITERS[out.dtype]["nearest_apart"], self._features[0]
        write(floats, who, wanted, places, arrays, spec, numbers, self.radius, team, out)

    def _by_row(self, part: AgentRows, wanted: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Agent, or -1, and wanted team of each row of the part's span; kept while rows stay."""
        key = part.block, part.span, self.of
        rows, *known = part.kept.get(key, (None,))
        if rows is not part.rows:
            first, last = part.span
            agent, teams = np.full(last - first, -1), np.zeros(last - first)
            agent[part.rows - first], teams[part.rows - first] = part.agents, wanted
            rows, *known = part.kept[key] = part.rows, agent, teams
        return known[0], known[1]

    def _write_blocks(
        self,
        simulation: Simulation,
        part: AgentRows,
        wanted: np.ndarray,
        numbers: tuple[int, ...],
        reach: float,
        out: np.ndarray,
    ) -> None:
        bodies, split = simulation.state.population.bodies, _split_of(simulation)
        index = bodies.index(reach, split)
        first, last = part.span
        blocks = index.blocks(first, last, split)
        world_start, keys, strips, _, _, points = index.table
        places = index.members, strips[1], index.order, world_start, keys, points
        table = *places, self._classes(simulation, index, split)
        agent, teams = self._by_row(part, wanted)
        who, found = (agent, first, bodies.team), (blocks.cuts, blocks.spans, blocks.points)
        write, spec = WRITERS[out.dtype]["nearest"], self._features[0]
        simulation.state.context.split(
            blocks.n_blocks,
            lambda *some: write(
                bodies.floats, who, teams, found, table, spec, numbers, self.radius, some, out
            ),
        )


@dataclass(frozen=True)
class Sectors(_Search):
    """A ring of n sectors around the agent, the first one ahead, counter-clockwise: 1 - distance / radius of the nearest other, else 0."""

    n: int
    radius: float
    of: str | int | None = None
    frame: str = "heading"

    def width(self, mission: Mission, block: str) -> int:
        check_features("Sectors", self.frame, (), (), 1.0)
        self._check_of(mission, self.radius, True)
        check_argument("Sectors: n", self.n, Whole(1))
        return self.n

    def bounds(self, mission: Mission, block: str) -> np.ndarray:
        return bounds_of([(0.0, 1.0)] * self.n)

    def write(self, simulation: Simulation, part: AgentRows, column: int, out: np.ndarray) -> None:
        mode, wanted = self._wanted(part, simulation)
        floats, places, arrays = self._index(simulation, self.radius)
        numbers = self.n, mode, FRAMES[self.frame], column
        who = part.rows, part.agents
        WRITERS[out.dtype]["sectors"](floats, who, wanted, places, arrays, numbers, self.radius, out)


@dataclass(frozen=True)
class Means(_Search):
    """Number of others within a radius, divided by `count_scale`, and the means of their columns, as named in `NearestOthers`."""

    radius: float
    columns: str = "offset relative_vel"
    of: str | int | None = None
    scale: Scale = 1.0
    frame: str = "heading"
    planar: bool = False
    count_scale: int = 1

    def width(self, mission: Mission, block: str) -> int:
        names = self.columns.split()
        check_features("Means", self.frame, names, (*RELATIVE, *OTHERS, *FLOATS), self.scale)
        self._check_of(mission, self.radius, True)
        return 1 + self._features[1]

    def bounds(self, mission: Mission, block: str) -> np.ndarray:
        count = (0.0, np.inf) if self.count_scale > 0 else (-np.inf, 0.0)
        return bounds_of(
            [count, *spans_of_others(self.columns.split(), self.scale, self.planar, self.radius)]
        )

    def write(self, simulation: Simulation, part: AgentRows, column: int, out: np.ndarray) -> None:
        spec, width = self._features
        mode, wanted = self._wanted(part, simulation)
        is_counted = width == 0 and simulation.state.population.bodies.n <= WHOLE_WORLD * simulation.n_worlds
        floats, places, arrays = self._index(simulation, self.radius, is_counted)
        numbers = mode, FRAMES[self.frame], column, width, self.count_scale
        who, team = (part.rows, part.agents), simulation.state.population.bodies.team
        WRITERS[out.dtype]["sums"](floats, who, wanted, places, arrays, spec, numbers, self.radius, team, out)


@dataclass(frozen=True)
class Each(_Others):
    """All entities of some blocks by their place in them, without the agent itself; zeros for those that are gone.

    The columns are those of `NearestOthers`.

    Attributes:
        of: Names of the blocks, separated by spaces.
    """

    of: str
    columns: str = "offset"
    scale: Scale = 1.0
    frame: str = "world"
    planar: bool = False

    def width(self, mission: Mission, block: str) -> int:
        names, blocks = self.columns.split(), {b.name: b.count for b in mission.blocks}
        check_features("Each", self.frame, names, (*RELATIVE, *OTHERS, *FLOATS), self.scale)
        for name in self.of.split():
            if name not in blocks:
                raise ParameterError(
                    f"Each: there is no block {name!r}{nearest_name(name, blocks)}; {listed(blocks)}"
                )
        n_others = sum(blocks[name] for name in self.of.split()) - (block in self.of.split())
        return n_others * self._features[1]

    def bounds(self, mission: Mission, block: str) -> np.ndarray:
        spans = spans_of_others(self.columns.split(), self.scale, self.planar, np.inf)
        return bounds_of(self.width(mission, block) // max(len(spans), 1) * spans)

    def write(self, simulation: Simulation, part: AgentRows, column: int, out: np.ndarray) -> None:
        spec, width = self._features
        bodies = simulation.state.population.bodies
        if self.of not in part.kept:
            part.kept[self.of] = self._places(simulation)
        of = part.kept[self.of]
        numbers = FRAMES[self.frame], column, width, of.shape[1] - (part.block in self.of.split())
        members = of, bodies.world, bodies.team
        who = part.rows, part.agents
        WRITERS[out.dtype]["each"](bodies.floats, who, members, spec, numbers, out)

    def _places(self, simulation: Simulation) -> np.ndarray:
        """Body row of each (world, place in the blocks), or -1."""
        bodies, blocks = simulation.state.population.bodies, simulation.mission.blocks
        parts = []
        for name in self.of.split():
            number = next(i for i, b in enumerate(blocks) if b.name == name)
            rows = np.flatnonzero((bodies.block == number) & (bodies.block_index < blocks[number].count))
            places = np.full((simulation.n_worlds, blocks[number].count), -1)
            places[bodies.world[rows], bodies.block_index[rows]] = rows
            parts.append(places)
        return np.concatenate(parts, axis=1)


__all__ = ["AgentRows", "Component", "Each", "Means", "NearestOthers", "Own", "Sectors"]
