"""Neighbour laws: the contribution of each neighbour, written as a function of a pair."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any

import numpy as np

from tussle.api.bodies import DERIVED, FLOATS, IN_PLACE, INTS, Bodies, CachedArrays
from tussle.api.group import GroupView
from tussle.declare.columns import Channel, Numbers, Param
from tussle.errors import DeclarationError, listed, nearest_name
from tussle.numeric.fingerprint import of_author, package
from tussle.numeric.kernel import Kernel, is_interpreted
from tussle.numeric.neighbors.chain import Chain, TurnChain
from tussle.numeric.neighbors.index import Blocks, Index
from tussle.numeric.neighbors.law import OTHER, PAIR, Law
from tussle.numeric.neighbors.walk import make_walk
from tussle.numeric.refusals import label

COMPONENTS = {3: "xyz", 4: "wxyz", 2: "xy"}
CODES = {"f": "F", "i": "I", "b": "B"}


def components(name: str, k: int) -> tuple[str, ...]:
    """Names of the components of a body column."""
    return tuple(f"{name}_{axis}" for axis in COMPONENTS[k]) if k > 1 else (name,)


BODY = {
    part: (name, place)
    for name, k in {**FLOATS, **dict.fromkeys(INTS, 1), **DERIVED}.items()
    for place, part in enumerate(components(name, k))
}
"""Column of the body table and component of each name that a law may take, vel_x, team, forward_z ..."""


def neighbors(
    *radius: str | float, teams: str | None = None, **reductions: str
) -> Callable[[Callable[..., Any]], NeighborLaw]:
    """Declare a function of a pair as a neighbour law.

    Arguments are matched by name: offset_x, offset_y, offset_z [m], distance [m], distance_squared [m^2] and inverse_distance [1/m]
    of the pair; body columns of the entity (vel_x, team, quat_w, yaw ...) and columns of the plugin (goal_x is field x of column
    goal); body columns of the neighbour with the prefix "other_". The function returns the contributions in the order of
    `reductions`, or None to skip the pair. In the plugin, `self.law(g)` returns the reduced contributions by name, (n,) each.

    Args:
        radius: Name of a parameter or state, or a number [m]. Only neighbours at a smaller distance count; with several radii, smaller
            than all of them. With update="sequential", the first radius of a law of an autonomy or controller is compared with the
            distance from the neighbour's position at the start of the step.
        teams: "own", "other", or None for all.
        **reductions: Name of each contribution and its reduction: "sum"; "mean", 0 without neighbours; "min" and "max", inf and -inf
            without neighbours; "count" of true values; "nearest", the value of the nearest neighbour (at equal distances that with
            the smaller id), NaN without neighbours. Or "each" for all contributions: `self.law(g)` then returns one value per pair,
            see `Listed`.

    Raises:
        DeclarationError: A reduction is unknown, no reduction or no radius is given, or "each" is mixed with other reductions.
    """

    def declare(function: Callable[..., Any]) -> NeighborLaw:
        law = law_of(function, radius, teams, reductions)
        if not radius or not reductions:
            raise DeclarationError(
                f"{label(law.function)}: give a radius and the contributions, such as @neighbors('sight', n='count')"
            )
        return NeighborLaw((law,), None, tuple(reductions))

    return declare


def together(*laws: NeighborLaw, where: Callable[..., Any] | None = None) -> NeighborLaw:
    """Evaluate several neighbour laws of a plugin in one pair loop; contribution n of a law `mates` is called `mates_n`.

    Args:
        laws: The laws.
        where: A function of a pair that returns whether the pair counts for any of the laws.

    Raises:
        DeclarationError: A law has the reduction "each".
    """
    for law in (law for each in laws for law in each.laws):
        if law.lists:
            raise DeclarationError(
                f"{label(law.function)}: a law with the reduction 'each' cannot be combined with others"
            )
    condition = law_of(where, (), None, {"counts": "count"}) if where is not None else None
    every = tuple(law for each in laws for law in each.laws)
    return NeighborLaw(
        every, condition, tuple(f"{law.function.__name__}_{name}" for law in every for name in law.reductions)
    )


def law_of(
    function: Callable[..., Any],
    radii: tuple[str | float, ...],
    teams: str | None,
    reductions: dict[str, str],
) -> Law:
    """Return the law of a function of a pair; the function may be a static method."""
    function = getattr(function, "__func__", function)
    return Law(function, tuple(inspect.signature(function).parameters), radii, teams, reductions)


class NeighborLaw:
    """Neighbour laws as an attribute of a plugin; a bound plugin calls it with its view and gets the contributions.

    Attributes:
        laws: Laws that share a pair loop.
        where: Condition for all laws, if any.
        names: Names of all contributions.
    """

    def __init__(self, laws: tuple[Law, ...], where: Law | None, names: tuple[str, ...]) -> None:
        self.laws, self.where, self.names = laws, where, names
        self.__doc__ = laws[0].function.__doc__
        self._plans: dict[type, WalkPlan] = {}
        self._digests: tuple[str, ...] = ()

    def __get__(self, plugin: Any, owner: type) -> Any:
        if plugin is None:
            return self
        plan = self._plans.get(owner)
        return partial(plan.walk if plan else self.first_walk, plugin)

    def first_walk(self, plugin: Any, g: GroupView) -> Contributions:
        """Make the plan for the plugin's class, and evaluate the laws."""
        plan = self._plans[type(plugin)] = make_plan(g, plugin, self)
        self._digests = self._digests or self.digests()
        return plan.walk(plugin, g)

    def digests(self) -> tuple[str, ...]:
        """Hashes of the functions, with all that they reach; none for those of tussle."""
        functions = [law.function for law in (*self.laws, *([self.where] if self.where else []))]
        return tuple(of_author(each) for each in functions if package(each) != "tussle")

    def refresh(self) -> None:
        """Forget the plans if what the functions reach has changed, e.g. a global redefined in an interactive shell."""
        if self._plans and self._digests != self.digests():
            self._plans.clear()
            self._digests = ()

    def check(self, cls: type, name: str) -> None:
        """Check that all arguments and radii of the laws exist in a plugin class.

        Raises:
            DeclarationError: An argument or radius is neither a name of the pair nor a column, or a radius is no real number.
        """
        own = [*PAIR, *own_columns(cls)]
        allowed = [*own, *(OTHER + part for part in BODY)]
        numbers = cls.declared(Numbers)  # type: ignore[attr-defined]
        for law in (*self.laws, *([self.where] if self.where else [])):
            for radius in law.radii:
                is_number = (
                    isinstance(radius, (int, float)) and not isinstance(radius, bool) and radius >= 0.0
                )
                if isinstance(radius, str) and radius in numbers:
                    is_number = numbers[radius].dtype is float
                if not (is_number or (isinstance(radius, str) and radius not in numbers)):
                    raise DeclarationError(
                        f"{label(law.function)}: {cls.__name__}.{name}: the radius {radius!r} is not allowed; it takes a real number >= 0, "
                        "or the name of a column of them, such as Param(30.0)"
                    )
            for column in law.columns:
                if column not in allowed:
                    raise DeclarationError(
                        f"{label(law.function)}: {cls.__name__}.{name}: {column!r} is neither a name of the pair nor a column"
                        f"{nearest_name(column, allowed)}; {listed(own)}; and body columns of the neighbour with the prefix {OTHER!r}"
                    )


class Contributions:
    """Contributions of the neighbours, by name, (n,) each.

    Attributes:
        values: All contributions in the order of the declaration, (k, n).
    """

    __slots__ = ("_names", "values")

    def __init__(self, names: tuple[str, ...], values: np.ndarray) -> None:
        self._names, self.values = names, values

    def __getattr__(self, name: str) -> np.ndarray:
        try:
            place = self._names.index(name)
        except ValueError:
            raise AttributeError(
                f"the law has no contribution {name!r}{nearest_name(name, self._names)}; {listed(self._names)}"
            ) from None
        return self.values[place, :]

    def __iter__(self) -> Iterator[np.ndarray]:
        return iter(self.values)


class Listed(Contributions):
    """Contributions of each pair, by name, (m,) each; ordered by row, the order within a row is deterministic.

    Attributes:
        values: All contributions in the order of the declaration, (k, m).
        row: Row of the view, (m,).
        other: Row of the neighbour in the body table, (m,).
    """

    __slots__ = ("other", "row")

    def __init__(
        self, names: tuple[str, ...], values: np.ndarray, row: np.ndarray, other: np.ndarray
    ) -> None:
        super().__init__(names, values)
        self.row, self.other = row, other

    def __len__(self) -> int:
        return len(self.row)


@lru_cache(maxsize=256)
def own_columns(cls: Any) -> dict[str, str]:
    """Return the Python expression of each column that laws of a plugin class may take, by name.

    Expressions use a view `g` and the plugin's attributes `own`.
    """
    found = {}
    for part, (name, place) in BODY.items():
        column = f"g.column({name!r})" if name in DERIVED else f"g.{name}"
        found[part] = column if part == name else f"{column}[{place}]"
    is_world = hasattr(cls, "start")  # world plugins; their class is in a higher layer
    for name, declared in cls.declared(Numbers).items():
        per = getattr(declared, "per", "world" if is_world else "entity")
        if declared.ragged or per == "team" or (isinstance(declared, Param) and not declared.is_row_data):
            continue
        fields = (
            declared.fields
            if isinstance(declared, Channel)
            else [f"{name}_{field}" for field in declared.fields]
        )
        parts = {part: f"own[{name!r}][{place}]" for place, part in enumerate(fields)} or {
            name: f"own[{name!r}]"
        }
        found |= {part: f"{text}[g.world]" if per == "world" else text for part, text in parts.items()}
    return found


@dataclass(slots=True, eq=False)
class Gathered:
    """What a pair loop takes while rows and parameters stay the same.

    Attributes:
        laid_out: The index and its arrays.
        blocks: Blocks of the rows.
        arrays: Arguments of the kernel.
        uses: Number of steps.
        chain: All kernels in one call, for positions that have changed: a `Chain`, or a `TurnChain` where entities move one after another.
    """

    laid_out: CachedArrays
    blocks: Blocks
    arrays: tuple[Any, ...]
    uses: int = 0
    chain: Any = None


@dataclass(frozen=True, slots=True, eq=False)
class WalkPlan:
    """Kernel of a pair loop and the columns of a plugin that it takes.

    Attributes:
        run: Kernel of the pair loop.
        run_single: Kernel for views with at most one row per world.
        names: Names of the contributions.
        radius: Function of a view and a plugin's attributes that returns the search radius [m].
        is_constant: The search radius is a parameter or a number.
        own: Function of the same arguments that returns the columns by row.
        other: Columns of the neighbours, by place: body column and components.
        lists: The kernel returns one value per pair instead of one per row.
        moving: Columns of the neighbours that change when an entity moves.
        keeps: The columns by row are arrays that stay the same until the rows change.
        placed: Names of `other`.
    """

    run: Callable[..., Any]
    run_single: Callable[..., Any]
    names: tuple[str, ...]
    radius: Callable[[GroupView, dict[str, Any]], Any]
    is_constant: bool
    own: Callable[[GroupView, dict[str, Any]], tuple[np.ndarray, ...]]
    other: tuple[tuple[str, tuple[int, ...]], ...]
    lists: bool
    moving: tuple[str, ...]
    keeps: bool
    placed: tuple[str, ...]

    def walk(self, plugin: Any, g: GroupView) -> Contributions:
        """Return the contributions of the neighbours of each row."""
        kept = g.kept.get((id(self), id(plugin)))
        if kept is not None and kept.chain is not None and kept.laid_out.version != g._bodies.version:
            chained = self._walk_in_turn if g._bodies.scans else self._walk_at_once
            out = chained(g._bodies, kept)
            if out is not None:
                return Contributions(self.names, out)
        blocks, arrays = self.gather(plugin, g)
        run = self.run_single if g._bodies.scans else self.run
        if self.lists:
            return self.listed(g, blocks.n_blocks, lambda *last: run(*arrays, *last, blocks.most))
        out = np.empty((len(self.names), g.n))
        if g.context.threads == 1:
            run(*arrays, out, g.first, (0, blocks.n_blocks), blocks.most)
        else:
            g.context.split(blocks.n_blocks, lambda *part: run(*arrays, out, g.first, part, blocks.most))
        return Contributions(self.names, out)

    def gather(self, plugin: Any, g: GroupView) -> tuple[Blocks, tuple[Any, ...]]:
        """Return the blocks of the rows and the arguments of the kernels, for the current positions."""
        key, bodies = (id(self), id(plugin)), g._bodies
        split = None if g.context.threads == 1 else g.split_rows
        share = None if split is None else g.context.split
        kept = g.kept.get(key)
        if kept is not None and self.is_constant:
            laid_out = kept.laid_out
        else:
            laid_out = bodies.laid_out(g.reach(self.radius(g, plugin.__dict__), self.is_constant))
        index = bodies.refreshed(laid_out, split)
        if kept is not None and kept.laid_out is laid_out:
            blocks, arrays = kept.blocks, kept.arrays
            if bodies.scans:  # each row has its whole world as candidates
                for name in self.moving:
                    bodies.by_place(index, name, split)
                arrays = self._with_points(bodies, index, blocks, arrays)
                kept.uses += 1
                if kept.uses == g.context.steady and split is None:
                    kept.chain = self._turns(g, kept, arrays)
                return blocks, arrays
            if index.blocks(g.first, g.last, share).spans is arrays[0][1]:
                for name, _ in self.other:
                    bodies.by_place(index, name, split)
                kept.uses += 1
                if kept.uses == g.context.steady and split is None:
                    kept.chain = self._chain(g, kept)
                return blocks, arrays
        blocks = index.blocks(g.first, g.last, share)
        others: tuple[np.ndarray, ...] = ()
        for name, places in self.other:
            columns = bodies.by_place(index, name, split)
            others += columns if len(columns) == len(places) else tuple([columns[place] for place in places])
        own = self.own(g, plugin.__dict__)
        arrays = (blocks.cuts, blocks.spans, index.order), (blocks.points, index.points), others, own
        if self.keeps:
            g.kept[key] = Gathered(laid_out, blocks, arrays)
        return blocks, self._with_points(bodies, index, blocks, arrays) if bodies.scans else arrays

    def _chain(self, g: GroupView, kept: Gathered) -> Chain | None:
        """The kernels of `walk` as one call; None for laws that run as Python, and where blocks do not change."""
        index, _, *pos = kept.laid_out.columns
        is_general = self.is_constant and not self.lists and not index.is_fixed
        if not (is_general and isinstance(self.run, Kernel)) or is_interpreted(self.run.py_func):
            return None
        columns = g._bodies.chained(kept.laid_out, self.placed)
        rows = g.first, g.last
        return Chain(index, tuple(pos), kept.blocks, rows, columns, self.run, kept.arrays, len(self.names))

    def _turns(self, g: GroupView, kept: Gathered, arrays: tuple[Any, ...]) -> TurnChain | None:
        """As `_chain`, where entities move one after another; None also for columns that are written in place."""
        run, blocks = self.run_single, kept.blocks
        if self.lists or not isinstance(run, Kernel) or is_interpreted(run.py_func):
            return None
        if set(self.moving) & set(IN_PLACE):
            return None
        moved = g._bodies.moved(kept.laid_out, self.moving)
        return TurnChain(moved, run, arrays, (g.first, g.last), blocks, len(self.names))

    def _walk_in_turn(self, bodies: Bodies, kept: Gathered) -> np.ndarray | None:
        """The contributions after one range of rows has moved; None if there was more."""
        chain, laid_out = kept.chain, kept.laid_out
        rows = bodies.rows_moved(laid_out, self.moving)
        if rows is None or bodies.range_points(laid_out.columns[0]) is not chain.points:
            return None
        out: np.ndarray = chain.run(rows)
        bodies.has_moved(laid_out, self.moving)
        return out

    def _walk_at_once(self, bodies: Bodies, kept: Gathered) -> np.ndarray | None:
        """The contributions for positions that have changed; None if there is no room for the spans of the blocks."""
        chain = kept.chain
        if chain.spans is not kept.blocks.spans:
            return None
        for name in self.placed:
            if name in DERIVED and name != "level_forward":
                bodies.derived(name)  # computed in place
        out: np.ndarray | None = chain.run()
        bodies.has_chained(kept.laid_out, self.placed)
        return out

    def _with_points(
        self, bodies: Bodies, index: Index, blocks: Blocks, arrays: tuple[Any, ...]
    ) -> tuple[Any, ...]:
        """The arguments of `run_single`: also the positions that decide who is in range."""
        longs, _, others, own = arrays
        return longs, (blocks.points, index.points, bodies.range_points(index)), others, own

    def listed(self, g: GroupView, n_blocks: int, run: Callable[..., int]) -> Listed:
        """Return the contributions of each pair."""
        made: list[tuple[np.ndarray, np.ndarray]] = []

        def fill(begin: int, end: int) -> None:
            size, n = -1, 8 * (end - begin)
            while n > size:  # repeat with larger arrays if there were more pairs
                size = n
                pairs, values = np.empty((2, size), np.int64), np.empty((len(self.names), size))
                n = run((pairs, values), g.first, (begin, end))
            made.append((pairs[:, :n], values[:, :n]))

        if g.context.threads == 1:
            fill(0, n_blocks)
        else:
            g.context.split(n_blocks, fill)
        pairs, values = (np.concatenate(arrays, axis=1) for arrays in zip(*made, strict=True))
        order = np.argsort(pairs[0], kind="stable")
        row, other = np.take(pairs, order, axis=1)
        return Listed(self.names, np.take(values, order, axis=1), row, other)


def make_plan(g: GroupView, plugin: Any, declared: NeighborLaw) -> WalkPlan:
    """Return the plan for neighbour laws of a plugin; the types of the columns are taken from `g` and `plugin`."""
    cls: Any = type(plugin)
    laws = declared.laws
    columns, scope = own_columns(cls), {"np": np}

    def evaluated(text: str) -> Any:
        return eval(f"lambda g, own: {text}", scope)  # noqa: S307 - consists of declared names

    made = make_walk(
        laws, declared.where, lambda name: CODES[evaluated(columns[name])(g, plugin.__dict__).dtype.kind]
    )
    common = set.intersection(*[set(law.radii) for law in laws])
    radii = [min(common, key=str)] if common else list(dict.fromkeys(law.radii[0] for law in laws))
    reach = [
        columns[radius] if isinstance(radius, str) else f"float({str(float(radius))!r})" for radius in radii
    ]
    farthest = reach[0] if len(reach) == 1 else f"np.maximum.reduce(np.broadcast_arrays({', '.join(reach)}))"
    other: dict[str, tuple[int, ...]] = {}
    for part in made.other:
        name, place = BODY[part.removeprefix(OTHER)]
        other[name] = (*other.get(name, ()), place)
    by_row = "".join(f"{columns[name]}, " for name in made.own)
    params = cls.params()
    constant = [*params, *(f"{name}_{field}" for name, param in params.items() for field in param.fields)]
    return WalkPlan(
        made.run,
        made.run_single,
        declared.names,
        evaluated(farthest),
        all(not isinstance(radius, str) or radius in constant for radius in radii),
        evaluated(f"({by_row})"),
        tuple(other.items()),
        laws[0].lists,
        tuple(name for name in other if name not in INTS),
        "column(" not in by_row and "g.world" not in by_row,
        tuple(other),
    )
