"""A simulation from outside: columns by path, snapshots, hashes, results."""

from __future__ import annotations

import pickle
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from tussle.api.bodies import BODY_UNITS, DERIVED, FLOATS, INTS, Bodies, derive
from tussle.api.plugin import Plugin
from tussle.columns import EntityRef, Handle, Numbers, Output, Param, State
from tussle.engine import failure
from tussle.engine.group import Binding, Group
from tussle.engine.result import WorldResult
from tussle.engine.table import Stored, Table
from tussle.errors import ParameterError, SnapshotError, listed
from tussle.mission import Block, paths
from tussle.record import hash_columns

if TYPE_CHECKING:
    from tussle.engine.simulation import Simulation

HASHED = ("id", "team", "block", "pos", "vel", "quat", "omega", "force", "torque", "health", "radius", "mass")


@dataclass
class Parked:
    """The last rows of a world that has ended: its part of the body table and of each group's table.

    Attributes:
        bodies: Its rows.
        tables: Key of the group -> (rows in `bodies`, what its table held of them).
    """

    bodies: Bodies
    tables: dict[Any, tuple[np.ndarray, Stored]]


FIELDS = {1: "", 2: "x y", 3: "x y z", 4: "w x y z"}
BODY_COLUMNS: dict[str, Numbers] = {
    **{name: State(FIELDS[k], BODY_UNITS[name].replace(" ", "*")) for name, k in (FLOATS | DERIVED).items()},
    **{name: State(dtype=int) for name in INTS},
}
"""Columns of a block's bodies, as a plugin would declare them."""


def park(sim: Simulation, world: int) -> Parked:
    """Keep a world's rows before they leave the table."""
    bodies = sim.population.bodies
    rows = np.flatnonzero(bodies.world == world)
    tables = {}
    for group in sim.population.groups:
        mine = np.flatnonzero((rows >= group.first) & (rows < group.last))
        if len(mine):
            tables[group.key] = mine, group.table.take(rows[mine] - group.first)
    return Parked(Bodies(bodies.floats[:, rows].copy(), bodies.ints[:, rows].copy(), bodies.n_worlds), tables)


# -- columns by path ------------------------------------------------------------------------------------------------------------


def _sources(sim: Simulation) -> Iterator[tuple[Bodies, list[tuple[Group, np.ndarray, Stored | Table]]]]:
    """Body tables with the rows of each group: the live one, then the worlds that have ended."""
    groups = sim.population.groups
    by_key = {g.key: g for g in groups}
    yield sim.population.bodies, [(g, np.arange(g.first, g.last), g.table) for g in groups]
    for world, parked in sim.parked.items():
        if not (sim.population.bodies.world == world).any():
            yield parked.bodies, [(by_key[k], rows, held) for k, (rows, held) in parked.tables.items()]


def _binding(group: Group, path: tuple[str, ...]) -> Binding | None:
    return next((b for b in group.walk() if b.path == path), None)


def _columns(owner: Any) -> dict[str, Numbers]:
    """Columns that an owner has in a simulation: those of bodies for a block, else those that its plugin declares."""
    if isinstance(owner, Block):
        return BODY_COLUMNS
    if not isinstance(owner, Plugin):
        return {}
    is_shared = {k for k, c in owner.params().items() if c.structural}
    return {k: c for k, c in owner.declared(Numbers).items() if k not in is_shared}


def _follow(sim: Simulation, path: str) -> tuple[Any, tuple[str, ...], str, Numbers]:
    """(block or world plugin, plugin path in the block, column, its declaration)."""
    owners, name = paths.follow(path, paths.Whole(sim.mission), paths.inside, _columns)
    return owners[0], tuple(p.instance_name for p in owners[1:]), name, _columns(owners[-1])[name]


def _body_column(bodies: Bodies, name: str, rows: np.ndarray) -> np.ndarray:
    if name in DERIVED:
        k = DERIVED[name]
        out = np.empty((k, len(rows)) if k > 1 else len(rows))
        derive(name, np.ascontiguousarray(bodies.quat[:, rows]), 0, len(rows), 0, out)
        return out
    return np.asarray(getattr(bodies, name)[..., rows])


MISSING: dict[str, Any] = {"f": np.nan, "i": -1, "b": False}
"""What `read` gives for who is dead or unborn, by kind of number."""


def capacity(sim: Simulation, number: int) -> int:
    """Entities that a block has room for in what `read` gives: those of the mission, and more only where plugins ask for births."""
    return max(sim.mission.blocks[number].count, int(sim.births.n_born[number].max(initial=0)))


def read(sim: Simulation, path: str) -> tuple[np.ndarray, np.ndarray]:
    """See `Simulation.read`."""
    head, key, name, column = _follow(sim, path)
    if not isinstance(head, Block):
        values = np.moveaxis(_world_column(sim, path, name), -1, 0).copy()
        return values, np.ones(len(values), bool)
    number = sim.context.block_names.index(head.name)
    shape = sim.n_worlds, capacity(sim, number)
    alive = np.zeros(shape, bool)
    empty = None if column.ragged else MISSING[np.dtype(column.dtype).kind]
    out = np.full(
        shape if column.ragged else (*shape, *column.shape), empty, object if column.ragged else column.dtype
    )
    for bodies, groups in _sources(sim):
        for group, rows, held in groups:
            mine = np.flatnonzero(bodies.block[rows] == number)
            binding = _binding(group, key) if key else None
            if not len(mine) or (key and binding is None):
                continue
            at = bodies.world[rows[mine]], bodies.place_in_block[rows[mine]]
            alive[at] = True
            if binding is None:
                out[at] = np.moveaxis(_body_column(bodies, name, rows[mine]), -1, 0)
            elif name in binding.ragged:
                for world, place, row in zip(*at, mine, strict=True):
                    out[world, place] = held.lists[binding.ragged[name]][row].copy()
            else:
                place = binding.places[name]
                data = held.arrays[place.dtype]
                values = data[place.first : place.first + place.k] if place.k else data[place.first]
                out[at] = np.moveaxis(values[..., mine], -1, 0)
    return out, alive


def _world_column(sim: Simulation, path: str, name: str) -> np.ndarray:
    head = path.partition(".")[0]
    referee = next(r for r in sim.referees if r.spec.instance_name == head)
    if name not in referee.places:
        raise ParameterError(f"{path!r} is the same in all worlds, and no column of the simulation")
    per, place = referee.places[name]
    if per == "entity":
        raise ParameterError(
            f"{path!r}: a column per entity of a world plugin has no fixed shape and cannot be read"
        )
    return referee.tables[per].array(place)


def write(sim: Simulation, path: str, values: Any) -> None:
    """See `Simulation.write`."""
    head, key, name, column = _follow(sim, path)
    if isinstance(values, str):
        try:
            values = column.read(values)
        except ParameterError as error:
            raise type(error)(f"{path!r}: {error}") from None
    if not isinstance(head, Block):
        array = _world_column(sim, path, name)
        given = np.moveaxis(_shaped(path, values, np.moveaxis(array, -1, 0).shape), 0, -1)
        _check_written(path, given, column)
        array[:] = given
        return
    if not key and name not in FLOATS:
        raise ParameterError(f"{path!r} cannot be written; {listed(FLOATS)}")
    if column.ragged:
        raise ParameterError(f"{path!r} is a list per entity, which a plugin makes; it cannot be written")
    number, bodies = sim.context.block_names.index(head.name), sim.population.bodies
    given = _shaped(path, values, (sim.n_worlds, capacity(sim, number), *column.shape))
    for group in sim.population.groups:
        rows = np.arange(group.first, group.last)
        mine = np.flatnonzero(bodies.block[rows] == number)
        binding = _binding(group, key) if key else None
        if not len(mine) or (key and binding is None):
            continue
        target = getattr(bodies, name) if binding is None else group.table.array(binding.places[name])
        part = np.moveaxis(given[bodies.world[rows[mine]], bodies.place_in_block[rows[mine]]], 0, -1)
        _check_written(path, part, column, is_body=binding is None)
        if binding is None:
            # Rows that are written as they were keep their motion state: taking it over from the attitude would round it.
            differs = np.atleast_2d(target[..., rows[mine]] != part).any(axis=0)
            target[..., rows[mine]] = part
            bodies.touch(group.first, group.last)
            if name in ("pos", "vel", "quat") and differs.any():
                group.moving.begin(group.motion.plugin)
                group.motion.plugin.from_body(group.moving, mine[differs])
        else:
            target[..., mine] = part
            for view in group.views:  # reaches of parameters are kept until the next repack
                view.reset(bodies, group.first, group.last)


def _shaped(path: str, values: Any, shape: tuple[int, ...]) -> np.ndarray:
    given = np.asarray(values)
    if given.dtype.kind not in "biuf":
        raise ParameterError(f"{path!r}: values are {given.dtype}; needed are numbers, or one text for all")
    try:
        return np.broadcast_to(given, shape)
    except ValueError:
        raise ParameterError(f"{path!r}: values have shape {given.shape}; needed is {shape}") from None


def _check_written(path: str, values: np.ndarray, column: Numbers, is_body: bool = False) -> None:
    if np.issubdtype(values.dtype, np.floating) and np.isnan(values).any():
        raise ParameterError(f"{path!r}: values hold NaN")
    if is_body and not path.endswith(".health") and not np.isfinite(values).all():
        raise ParameterError(f"{path!r}: values must be finite")
    if column.dtype is int:
        with np.errstate(invalid="ignore"):
            if (np.asarray(values).astype(np.int64) != values).any():
                raise ParameterError(f"{path!r}: values must be whole numbers of 64 bits")
    if isinstance(column, Param):
        different = np.unique(values, axis=-1).T if column.fields else np.unique(values)
        for value in different.tolist():
            column.convert(value, path)


# -- snapshots --------------------------------------------------------------------------------------------------------------------


@dataclass
class Snapshot:
    """All columns of a simulation at one instant."""

    mission: Any
    seeds: np.ndarray
    groups: dict[Any, tuple[Any, ...]]
    world: dict[str, Any]


def snapshot(sim: Simulation) -> Snapshot:
    """See `Simulation.snapshot`."""
    population, births = sim.population, sim.births
    groups = {}
    for group in population.groups:
        outside = [_save_handles(b) for b in group.walk()]
        groups[group.key] = (group.first, group.table.copy(), outside)
    world = {
        "floats": population.bodies.floats.copy(),
        "ints": population.bodies.ints.copy(),
        "step": sim.context.clock.step.copy(),
        "common": sim.context.clock.common,
        "running": sim.running.copy(),
        "failed": sim.failed.copy(),
        "results": list(sim.results),
        "parked": dict(sim.parked),
        "births": [
            births.next_id.copy(),
            births.n_born.copy(),
            births.n_left.copy(),
            [a.copy() for a in births.next_time],
        ],
        "referees": [r.copy() for r in sim.referees],
        "mail": sim.mail.save(),
        "wishes": list(sim.world_view.births),
        "params": sim.overrides.save(),
    }
    return Snapshot(sim.mission, sim.context.seeds.copy(), groups, world)


def _save_handles(binding: Binding) -> dict[str, list[bytes]]:
    name, saves = type(binding.spec).__name__, hasattr(type(binding.spec), "save_one")

    def save(h: Any) -> bytes:
        if h is not None and not saves:
            raise SnapshotError(
                f"{name} holds objects outside the arrays and cannot save them, so no snapshot can be taken"
            )
        return pickle.dumps((h is not None, None if h is None else binding.plugin.save_one(h)))

    return {k: [save(h) for h in held] for k, held in binding.handles.items()}


def restore(sim: Simulation, saved: Snapshot) -> None:
    """See `Simulation.restore`."""
    if saved.mission != sim.mission or len(saved.seeds) != sim.n_worlds:
        raise SnapshotError(
            f"the snapshot is of a stack of {len(saved.seeds)} worlds of {saved.mission.name or 'another mission'!r}, not of this"
        )
    population, births, world = sim.population, sim.births, saved.world
    if not set(saved.groups) <= {g.key for g in population.groups}:
        raise SnapshotError(
            "the snapshot has entities of blocks that this simulation has never had; restore it into the simulation it was taken from"
        )
    sim.context.seeds[:] = saved.seeds
    population.close_handles()
    population.bodies.replace(world["floats"].copy(), world["ints"].copy())
    for group in population.groups:
        kept = saved.groups.get(group.key)
        first, held, outside = kept or _no_rows(group, population.bodies.n)
        group.table.restore(held)
        for binding, handles in zip(group.walk(), outside, strict=True):
            binding.handles = {k: [None] * len(held) for k, held in handles.items()}
        group.attach(population.bodies, first)
        _load_handles(sim, group, outside)
    births.next_id, births.n_born, births.n_left = (a.copy() for a in world["births"][:3])
    births.next_time = [a.copy() for a in world["births"][3]]
    clock = sim.context.clock
    clock.step[:], clock.common = world["step"], world["common"]
    sim.running[:], sim.failed[:] = world["running"], world["failed"]
    sim.results, sim.parked = list(world["results"]), dict(world["parked"])
    sim.world_view.births = list(world["wishes"])
    sim.world_view.deaths, sim.world_view.moved = [], []  # of a step that was broken off
    sim.overrides.restore(world["params"])
    sim.after_restore()
    for referee, columns in zip(sim.referees, world["referees"], strict=True):
        referee.restore(columns)
    sim.mail.restore(world["mail"])


def _no_rows(group: Group, first: int) -> tuple[Any, ...]:
    none = group.table.take(np.zeros(0, np.int64))
    return first, none, [{k: [] for k in b.handles} for b in group.walk()]


def _load_handles(sim: Simulation, group: Group, outside: list[dict[str, list[bytes]]]) -> None:
    for binding, handles in zip(group.walk(), outside, strict=True):
        binding.view.begin(binding.plugin)
        for name, held in handles.items():
            for row, data in enumerate(held):
                about = sim.population.handle_row(group, binding, row)
                is_open, state = pickle.loads(data)
                binding.handles[name][row] = _loaded(binding.plugin, about, state) if is_open else None


def _loaded(plugin: Any, about: Any, state: Any) -> Any:
    return plugin.load_one(about, state) if hasattr(type(plugin), "load_one") else plugin.open_one(about)


# -- hash and result ----------------------------------------------------------------------------------------------------------------


def state_hash(sim: Simulation, world: int) -> str:
    """Hash of one running world's columns."""
    return hash_columns(_hashed(sim, world))


def _hashed(sim: Simulation, world: int) -> Iterator[tuple[str, Any]]:
    bodies = sim.population.bodies
    members, world_start, _, _ = bodies.layout()
    rows = members[world_start[world] : world_start[world + 1]]
    yield "step", sim.context.clock.step[world : world + 1]
    yield (
        "births",
        np.concatenate(
            [sim.births.next_id[world : world + 1], sim.births.n_born[:, world], sim.births.n_left[:, world]]
        ),
    )
    for times in sim.births.next_time:
        yield "births", times[world]
    for wish in sim.world_view.births:
        mine = wish["world"] == world
        if mine.any():
            yield "wish", f"{wish['block']} {mine.sum()}".encode()
            yield from (
                (name, array[..., mine]) for name, array in wish.items() if name not in ("block", "world")
            )
    for name in HASHED:
        yield name, getattr(bodies, name)[..., rows]
    parts = []
    for group in sim.population.groups:
        first, last = np.searchsorted(bodies.world[group.first : group.last], [world, world + 1])
        if last > first:
            parts.append((int(bodies.id[group.first + first]), group, np.arange(first, last)))
    for _, group, mine in sorted(parts, key=lambda part: part[0]):
        for binding in group.walk():
            yield from _hashed_columns(group, binding, mine)
    for referee in sim.referees:
        for name in type(referee.spec).states():
            per, place = referee.places[name]
            array = referee.tables[per].array(place)
            yield (
                f"{referee.spec.instance_name}.{name}",
                array[..., rows if per == "entity" else slice(world, world + 1)],
            )
    for part in sim.mail.columns(world):
        yield "mail", part


def _hashed_columns(group: Group, binding: Binding, rows: np.ndarray) -> Iterator[tuple[str, Any]]:
    for name, column in type(binding.spec).columns.items():
        is_memory = isinstance(column, (State, EntityRef)) or (
            isinstance(column, Output) and name in binding.plugin.wired
        )
        label = ".".join((*binding.path, name))
        if is_memory and name in binding.ragged:
            lists = group.table.lists[binding.ragged[name]].take(rows)
            yield label, np.concatenate([lists.start.view(np.float64), lists.data.astype(np.float64).ravel()])
        elif is_memory:
            yield label, group.table.array(binding.places[name])[..., rows]
        assert not isinstance(column, Handle) or name in binding.handles


def world_result(sim: Simulation, world: int, reason: str, is_hashed: bool = True) -> WorldResult:
    """What a world's game has come to by now; without the state hash where that is not wanted, which takes longer than the rest."""
    bodies = sim.population.bodies
    here = bodies.team[bodies.world == world]
    alive = {int(team): int((here == team).sum()) for team in sim.context.teams}
    clock = sim.context.clock
    steps = int(clock.step[world])
    result = WorldResult(world, int(sim.context.seeds[world]), reason, steps, float(clock.t[world]), alive)
    scores: dict[int, float] = {}
    for referee in [*sim.interactions, *sim.metrics]:
        referee.view.begin(referee.plugin)
        try:
            found = referee.plugin.result_of(referee.view, world)
        except Exception as error:
            if reason == "error":  # something has failed already, and this may come of it
                continue
            raise failure.raised(error, referee.plugin, where="result", step=steps, world=world) from error
        if found:
            result.metrics[referee.spec.instance_name] = found
        for team, score in (found.get("score") or {}).items() if referee in sim.metrics else ():
            scores[team] = scores.get(team, 0.0) + score
    result.scores = scores
    if is_hashed:
        result.state_hash = state_hash(sim, world)
    return result
