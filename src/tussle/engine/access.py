"""Reading and writing columns of a simulation by path."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from tussle.api.bodies import BODY_UNITS, DERIVED, FLOATS, INTS, Bodies, derived_from, problems_of_states
from tussle.api.kinds import row_shape
from tussle.api.plugin import Plugin
from tussle.declare.columns import Numbers, Param, State
from tussle.engine.group import Binding, Group
from tussle.engine.params import item_of
from tussle.engine.state import SimulationState
from tussle.engine.table import Stored, Table
from tussle.engine.world_bindings import WorldBinding
from tussle.errors import ParameterError, listed
from tussle.mission import Block, paths

FIELDS = {1: "", 2: "x y", 3: "x y z", 4: "w x y z"}
BODY_COLUMNS: dict[str, Numbers] = {
    **{name: State(FIELDS[k], BODY_UNITS[name].replace(" ", "*")) for name, k in (FLOATS | DERIVED).items()},
    **{name: State(dtype=int) for name in INTS},
}
"""Body columns as declarations."""


def _sources(
    state: SimulationState,
) -> Iterator[tuple[Bodies, list[tuple[Group, np.ndarray, Stored | Table]]]]:
    """Yield body tables with the rows of each group: that of the running worlds, then those of ended worlds."""
    groups = state.population.groups
    by_key = {g.key: g for g in groups}
    yield state.population.bodies, [(g, np.arange(g.first, g.last), g.table) for g in groups]
    for world, parked in state.parked.items():
        if not (state.population.bodies.world == world).any():
            yield parked.bodies, [(by_key[k], rows, held) for k, (rows, held) in parked.tables.items()]


def _binding(group: Group, path: tuple[str, ...]) -> Binding | None:
    return next((b for b in group.walk() if b.path == path), None)


def _columns(owner: Any) -> dict[str, Numbers]:
    """Columns of an owner of a path: body columns for a block, declared columns for a plugin."""
    if isinstance(owner, Block):
        return BODY_COLUMNS
    if not isinstance(owner, Plugin):
        return {}
    is_shared = {k for k, c in owner.params().items() if c.structural}
    return {k: c for k, c in owner.declared(Numbers).items() if k not in is_shared}


def _located(state: SimulationState, path: str) -> tuple[Any, tuple[str, ...], str, Numbers, tuple[int, ...]]:
    """Resolve a path.

    Returns:
        The block or world plugin, the plugin path in the block, the column's name, its declaration, and the shape of one row's value.
    """
    root = paths.MissionRoot(state.mission)
    try:
        owners, name = paths.resolve(path, root, paths.inside, _columns)
    except ParameterError:
        owners, name = paths.resolve(path, root, paths.inside, lambda owner: None)
        if name in paths.settable(owners[-1] if owners else root):
            raise ParameterError(
                f"{path!r} is fixed once the simulation is built: it is no column that can be read or written; set it in the mission"
            ) from None
        raise
    owner, column = owners[-1], _columns(owners[-1])[name]
    shape = column.shape if isinstance(owner, Block) or column.ragged else row_shape(owner, column)
    return owners[0], tuple(p.instance_name for p in owners[1:]), name, column, shape


def _body_column(bodies: Bodies, name: str, rows: np.ndarray) -> np.ndarray:
    if name in DERIVED:
        return derived_from(name, bodies.quat[:, rows])
    return np.asarray(getattr(bodies, name)[..., rows])


MISSING: dict[str, Any] = {"f": np.nan, "i": -1, "b": False}
"""Values that `read` returns for entities that are dead or unborn, by kind of number."""


def capacity(state: SimulationState, number: int) -> int:
    """Number of entities of a block in the arrays of `read`: its count, or more if plugins have spawned entities."""
    return max(state.mission.blocks[number].count, int(state.births.n_born[number].max(initial=0)))


def read(state: SimulationState, path: str) -> tuple[np.ndarray, np.ndarray]:
    """See `Simulation.read`."""
    head, key, name, column, of_row = _located(state, path)
    if not isinstance(head, Block):
        values = np.moveaxis(_world_column(state, path, name), -1, 0).copy()
        return values, np.ones(len(values), bool)
    number = state.context.block_names.index(head.name)
    shape = state.n_worlds, capacity(state, number)
    alive = np.zeros(shape, bool)
    empty = None if column.ragged else MISSING[np.dtype(column.dtype).kind]
    out = np.full(
        shape if column.ragged else (*shape, *of_row), empty, object if column.ragged else column.dtype
    )
    for bodies, groups in _sources(state):
        for group, rows, held in groups:
            mine = np.flatnonzero(bodies.block[rows] == number)
            binding = _binding(group, key) if key else None
            if not len(mine) or (key and binding is None):
                continue
            if binding is not None:
                binding.check_is_written(name, repr(path))
            at = bodies.world[rows[mine]], bodies.block_index[rows[mine]]
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


def _world_binding(state: SimulationState, path: str) -> WorldBinding:
    head = path.partition(".")[0]
    return next(r for r in state.world_bindings if r.spec.instance_name == head)


def _world_column(state: SimulationState, path: str, name: str) -> np.ndarray:
    world_binding = _world_binding(state, path)
    if name not in world_binding.places:
        raise ParameterError(f"{path!r} is the same in all worlds; it is not a column")
    per, place = world_binding.places[name]
    if per == "entity":
        raise ParameterError(
            f"{path!r}: columns per entity of a world plugin have no fixed shape and cannot be read"
        )
    return world_binding.tables[per].array(place)


def write(state: SimulationState, path: str, values: Any, world: int | None = None) -> np.ndarray:
    """See `Simulation.write`.

    Args:
        state: The simulation.
        path: Path of the column.
        values: Values of all worlds, or (k, ...) of `world`; of a world plugin (...).
        world: The only world that is written to.

    Returns:
        The values of all worlds, (n_worlds, capacity, ...); of a world plugin (n_worlds, ...).
    """
    head, key, name, column, of_row = _located(state, path)
    if isinstance(values, str):
        try:
            values = column.read(values)
        except ParameterError as error:
            raise type(error)(f"{path!r}: {error}") from None
    if not isinstance(head, Block):
        array = _world_column(state, path, name)
        some = slice(None) if world is None else slice(world, world + 1)
        target = np.moveaxis(array, -1, 0)[some]
        new_values = _shaped(path, values, target.shape)
        _check_written(path, np.moveaxis(new_values, 0, -1), column)
        _check_together(
            path, head, np.moveaxis(new_values, 0, -1), lambda k: _world_column(state, path, k)[..., some]
        )
        target[:] = new_values
        state.world_view.renew()  # it keeps values of parameters
        return new_values
    if not key and name not in FLOATS:
        raise ParameterError(f"{path!r} cannot be written; {listed(FLOATS)}")
    if column.ragged:
        raise ParameterError(f"{path!r} is a list per entity; lists cannot be written")
    number, bodies = state.context.block_names.index(head.name), state.population.bodies
    shape = (state.n_worlds, capacity(state, number), *of_row)
    if world is None:
        new_values = _shaped(path, values, shape)
    else:
        given = np.asarray(values)
        new_values = np.zeros(shape, given.dtype)
        new_values[world, : len(given)] = given
    for group in state.population.groups:
        rows = np.arange(group.first, group.last)
        is_mine = bodies.block[rows] == number
        mine = np.flatnonzero(is_mine if world is None else is_mine & (bodies.world[rows] == world))
        binding = _binding(group, key) if key else None
        if not len(mine) or (key and binding is None):
            continue
        target = getattr(bodies, name) if binding is None else group.table.array(binding.places[name])
        part = np.moveaxis(new_values[bodies.world[rows[mine]], bodies.block_index[rows[mine]]], 0, -1)
        _check_written(path, part, column, is_body=binding is None)
        if binding is None:
            # Unchanged rows keep their motion state: setting it from the attitude would round it.
            differs = np.atleast_2d(target[..., rows[mine]] != part).any(axis=0)
            target[..., rows[mine]] = part
            bodies.has_loads = True
            bodies.touch(group.first, group.last)
            if name in ("pos", "vel", "quat", "omega") and differs.any():
                group.motion_view.begin(group.motion.plugin)
                group.motion.plugin.from_body(group.motion_view, mine[differs])
        else:
            table, places = group.table, binding.places
            _check_together(path, binding.spec, part, lambda k: table.array(places[k])[..., mine])  # noqa: B023 - called at once
            target[..., mine] = part
            for view in group.views:  # views cache the reaches of parameters until the next repack
                view.reset(bodies, group.first, group.last)
    return new_values


def _shaped(path: str, values: Any, shape: tuple[int, ...]) -> np.ndarray:
    array = np.asarray(values)
    if array.dtype.kind not in "biuf":
        raise ParameterError(
            f"{path!r}: values are {array.dtype}; they must be numbers, or one text for all entities"
        )
    try:
        return np.broadcast_to(array, shape)
    except ValueError:
        raise ParameterError(
            f"{path!r}: values have shape {array.shape}; the shape must be {shape}"
        ) from None


def _check_written(path: str, values: np.ndarray, column: Numbers, is_body: bool = False) -> None:
    if np.issubdtype(values.dtype, np.floating) and np.isnan(values).any():
        raise ParameterError(f"{path!r}: values hold NaN")
    if is_body and not path.endswith(".health") and not np.isfinite(values).all():
        raise ParameterError(f"{path!r}: values must be finite")
    if is_body:
        for _, text in (
            problems_of_states(path.rpartition(".")[2], np.atleast_2d(values))
            if path.endswith(".quat")
            else ()
        ):
            raise ParameterError(f"{path!r}: {text}")
        if path.endswith((".mass", ".radius")) and not (np.asarray(values) > 0.0).all():
            raise ParameterError(f"{path!r}: values must be > 0")
    if column.dtype is bool and not np.isin(values, (0, 1)).all():
        raise ParameterError(f"{path!r}: values must be true or false")
    if column.dtype is int:
        with np.errstate(invalid="ignore"):
            if (np.asarray(values).astype(np.int64) != values).any():
                raise ParameterError(f"{path!r}: values must be whole numbers of 64 bits")
    if isinstance(column, Param):
        different = np.unique(values, axis=-1).T if column.fields else np.unique(values)
        for value in different.tolist():
            column.convert(value, path)


def _check_together(path: str, plugin: Plugin, new: np.ndarray, stored: Callable[[str], np.ndarray]) -> None:
    """Check a parameter that is being written, (..., n), with those that its plugin compares it with, such as lower and upper limits."""
    written, params = path.rpartition(".")[2], plugin.params()
    names = [k for k, p in params.items() if not (p.structural or p.ragged or p.is_text)]
    if type(plugin).check_values is Plugin.check_values or written not in names:
        return
    values = {k: new if k == written else stored(k) for k in names}
    every = np.concatenate([np.atleast_2d(each).astype(float) for each in values.values()])
    for i in np.unique(every, axis=1, return_index=True)[1]:
        try:
            plugin.check_values_with({k: item_of(each[..., i]) for k, each in values.items()})
        except ParameterError as error:
            raise ParameterError(f"{path!r}: {error}") from None
