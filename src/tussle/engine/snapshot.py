"""Snapshots, their restoration, and the state hash: all columns of a simulation."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from tussle.declare.columns import EntityRef, Handle, Output, State
from tussle.engine.group import Binding, Group
from tussle.engine.manual import manual_columns
from tussle.engine.rows import rows_changed
from tussle.engine.state import SimulationState
from tussle.errors import SnapshotError, clipped
from tussle.mission import Mission
from tussle.mission.paths import values_of
from tussle.record import hash_columns

HASHED = ("id", "team", "block", "pos", "vel", "quat", "omega", "force", "torque", "health", "radius", "mass")

MAX_DIFFERENCES = 3


@dataclass
class Snapshot:
    """Copy of all columns of a simulation."""

    mission: Any
    seeds: np.ndarray
    groups: dict[Any, tuple[Any, ...]]
    world: dict[str, Any]


def snapshot(state: SimulationState) -> Snapshot:
    """See `Simulation.snapshot`."""
    population, births = state.population, state.births
    groups = {}
    for group in population.groups:
        handles = [_save_handles(b) for b in group.walk()]
        groups[group.key] = (group.first, group.table.copy(), handles)
    world = {
        "floats": population.bodies.floats.copy(),
        "ints": population.bodies.ints.copy(),
        "step": state.context.clock.step.copy(),
        "common": state.context.clock.common,
        "running": state.running.copy(),
        "failed": state.failed.copy(),
        "results": list(state.results),
        "parked": dict(state.parked),
        "rekeys": dict(state.rekeys),
        "manual": dict(state.manual),
        "births": copy.deepcopy(
            (
                births.next_id,
                births.n_born,
                births.n_left,
                births.next_time,
                births.n_waiting,
                births.n_waited,
            )
        ),
        "world_plugins": [r.copy() for r in state.world_bindings],
        "messages": state.message_bus.save(),
        "requested_births": list(state.world_view.births),
        "params": state.overrides.save(),
    }
    return Snapshot(state.mission, state.context.seeds.copy(), groups, world)


def _save_handles(binding: Binding) -> dict[str, list[bytes]]:
    name, saves = type(binding.spec).__name__, hasattr(type(binding.spec), "save_one")

    def save(h: Any) -> bytes:
        if h is not None and not saves:
            raise SnapshotError(
                f"{name} holds objects outside the arrays and has no method save_one; no snapshot can be taken"
            )
        return pickle.dumps((h is not None, None if h is None else binding.plugin.save_one(h)))

    return {k: [save(h) for h in held] for k, held in binding.handles.items()}


def restore(state: SimulationState, saved: Snapshot) -> None:
    """See `Simulation.restore`."""
    if not isinstance(saved, Snapshot):
        raise SnapshotError(f"restore takes what `snapshot` returned, not {saved!r:.60}")
    if saved.mission != state.mission or len(saved.seeds) != state.n_worlds:
        raise SnapshotError(
            f"the snapshot has {len(saved.seeds)} worlds of mission {saved.mission.name!r}, the simulation {state.n_worlds} of mission "
            f"{state.mission.name!r}; numbers of worlds and missions must be equal{_differences(saved.mission, state.mission)}"
        )
    population, births, world = state.population, state.births, saved.world
    if not set(saved.groups) <= {g.key for g in population.groups}:
        raise SnapshotError(
            "the snapshot has entities of a block that has had none in this simulation; restore it into the simulation it was taken from"
        )
    state.context.seeds[:] = state.context.keys[:] = saved.seeds
    population.close_handles()
    population.bodies.replace(world["floats"].copy(), world["ints"].copy())
    for group in population.groups:
        kept = saved.groups.get(group.key)
        first, table, handles = kept or _no_rows(group, population.bodies.n)
        group.table.restore(table)
        for binding, saved_handles in zip(group.walk(), handles, strict=True):
            binding.handles = {k: [None] * len(objects) for k, objects in saved_handles.items()}
        group.attach(population.bodies, first)
        _load_handles(state, group, handles)
    (
        births.next_id, births.n_born, births.n_left, births.next_time, births.n_waiting, births.n_waited,
    ) = copy.deepcopy(world["births"])  # fmt: skip
    clock = state.context.clock
    clock.step[:], clock.common = world["step"], world["common"]
    state.running[:], state.failed[:] = world["running"], world["failed"]
    state.results, state.parked = list(world["results"]), dict(world["parked"])
    state.rekeys = dict(world["rekeys"])
    if bool(state.manual) != bool(world["manual"]):
        population.on_new_group()
    state.manual = dict(world["manual"])
    state.world_view.births = list(world["requested_births"])
    state.world_view.deaths, state.world_view.moved = [], []  # requested in an interrupted step
    state.overrides.restore(world["params"])
    state.n_running = int(state.running.sum())
    rows_changed(state)
    for world_binding, columns in zip(state.world_bindings, world["world_plugins"], strict=True):
        world_binding.restore(columns)
    state.message_bus.restore(world["messages"])


def _differences(saved: Mission, own: Mission) -> str:
    """What differs between two missions: "; in the snapshot, prey.count = 9 (here 10)"; "" where nothing does."""
    there, here = values_of(saved), values_of(own)
    both = there.keys() & here.keys()
    texts = [
        f"{path} = {_shown(there, path)} (here {_shown(here, path)})"
        for path in dict.fromkeys([*there, *here])
        if path.rpartition(".")[0] in ("", *both) and (path not in both or there[path] != here[path])
    ]
    more = f", and {len(texts) - MAX_DIFFERENCES} more" if len(texts) > MAX_DIFFERENCES else ""
    return f"; in the snapshot, {', '.join(texts[:MAX_DIFFERENCES])}{more}" if texts else ""


def _shown(values: Mapping[str, Any], path: str) -> str:
    value = values.get(path, "absent")
    return value.__name__ if isinstance(value, type) else clipped(repr(value)) if path in values else value


def _no_rows(group: Group, first: int) -> tuple[Any, ...]:
    none = group.table.take(np.zeros(0, np.int64))
    return first, none, [{k: [] for k in b.handles} for b in group.walk()]


def _load_handles(state: SimulationState, group: Group, saved: list[dict[str, list[bytes]]]) -> None:
    for binding, handles in zip(group.walk(), saved, strict=True):
        binding.view.begin(binding.plugin)
        for name, held in handles.items():
            for row, data in enumerate(held):
                about = state.population.handle_row(group, binding, row)
                is_open, kept = pickle.loads(data)
                binding.handles[name][row] = _loaded(binding.plugin, about, kept) if is_open else None


def _loaded(plugin: Any, about: Any, state: Any) -> Any:
    return plugin.load_one(about, state) if hasattr(type(plugin), "load_one") else plugin.open_one(about)


def state_hash(state: SimulationState, world: int) -> str:
    """Hash of one running world's columns."""
    return hash_columns(hashed(state, world))


def hashed(state: SimulationState, world: int) -> Iterator[tuple[str, Any]]:
    """Yield name and values of each hashed column of one running world."""
    bodies = state.population.bodies
    members, world_start, _, _ = bodies.layout()
    rows = members[world_start[world] : world_start[world + 1]]
    yield "step", state.context.clock.step[world : world + 1]
    births = state.births
    counts = births.next_id[world : world + 1], births.n_born[:, world], births.n_left[:, world]
    waits = births.n_waiting[:, world], births.n_waited[:, world]
    yield "births", np.concatenate([*counts, *(waits if waits[1].any() else ())])
    for times in births.next_time:
        yield "births", times[world]
    for request in state.world_view.births:
        mine = request["world"] == world
        if mine.any():
            yield "wish", f"{request['block']} {mine.sum()}".encode()
            yield from ((k, array[..., mine]) for k, array in request.items() if k not in ("block", "world"))
    if (driven := manual_columns(state, world)).size:
        yield "manual", driven
    for name in HASHED:
        yield name, getattr(bodies, name)[..., rows]
    parts = []
    for group in state.population.groups:
        first, last = np.searchsorted(bodies.world[group.first : group.last], [world, world + 1])
        if last > first:
            parts.append((int(bodies.id[group.first + first]), group, np.arange(first, last)))
    for _, group, mine in sorted(parts, key=lambda part: part[0]):
        for binding in group.walk():
            yield from _hashed_columns(group, binding, mine)
    for world_binding in state.world_bindings:
        for name in type(world_binding.spec).states():
            per, place = world_binding.places[name]
            array = world_binding.tables[per].array(place)
            mine = rows if per == "entity" else slice(world, world + 1)
            yield f"{world_binding.spec.instance_name}.{name}", array[..., mine]
    for part in state.message_bus.columns(world):
        yield "mail", part


def _hashed_columns(group: Group, binding: Binding, rows: np.ndarray) -> Iterator[tuple[str, Any]]:
    unused = binding.spec.unused_states()
    for name, column in type(binding.spec).columns.items():
        is_memory = isinstance(column, (State, EntityRef)) or (
            isinstance(column, Output) and name in binding.wired
        )
        is_memory &= name not in unused
        label = ".".join((*binding.path, name))
        if is_memory and name in binding.ragged:
            lists = group.table.lists[binding.ragged[name]].take(rows)
            yield label, np.concatenate([lists.start.view(np.float64), lists.data.astype(np.float64).ravel()])
        elif is_memory:
            yield label, group.table.array(binding.places[name])[..., rows]
        assert not isinstance(column, Handle) or name in binding.handles
