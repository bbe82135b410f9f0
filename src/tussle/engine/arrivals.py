"""Entity births: initial entities of worlds that are reset, scheduled births, and entities that plugins spawn."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from tussle.api.bodies import Bodies
from tussle.api.kinds import Interaction, WorldPlugin
from tussle.api.world import WorldView
from tussle.engine import failure
from tussle.engine.births import Occupancy, in_order, joined
from tussle.engine.rows import apply_moves, repack
from tussle.engine.state import SimulationState
from tussle.engine.step_end import remove_dead
from tussle.engine.subset import call_world_plugin
from tussle.engine.world_bindings import WorldBinding
from tussle.errors import MissionError


def reset(
    state: SimulationState,
    worlds: Sequence[int],
    seeds: Sequence[int] | None,
    params: Mapping[str, Any] | None,
) -> None:
    """See `Simulation.reset`, which has checked worlds and seeds."""
    numbers, chosen = np.array(worlds, np.int64), np.array(sorted(worlds), np.int64)
    mask = np.zeros(state.n_worlds, bool)
    mask[chosen] = True
    if params:
        state.overrides.set(params, numbers)
    if seeds is not None:
        state.context.seeds[numbers] = np.array(seeds, np.uint64)
    state.context.keys[chosen] = state.context.seeds[chosen]
    clock, view = state.context.clock, state.world_view
    clock.step[chosen] = 0
    state.running[chosen], state.failed[chosen] = True, False
    state.n_running = int(np.count_nonzero(state.running))
    for world in chosen:
        state.results[world] = None
        state.parked.pop(int(world), None)
    for key in [key for key in state.manual if mask[key[0]]]:
        del state.manual[key]
    state.message_bus.drop_worlds(mask)
    view.births = [
        {k: v if k == "block" else v[..., ~mask[b["world"]]] for k, v in b.items()} for b in view.births
    ]
    for world_binding in state.world_bindings:
        world_binding.reset(chosen)
        if state.overrides.columns:
            world_binding.fill_params(state.overrides, chosen)
    due = state.births.begin(chosen)
    removed = mask | ~state.running  # when all worlds have ended, those that ended last still have rows
    repack(state, removed[state.population.bodies.world], _create(state, due, at_start=True))
    steps = clock.step[state.running]
    clock.common = int(steps[0]) if len(steps) and (steps == steps[0]).all() else -1
    _start_world_plugins(state, mask)
    remove_dead(state)


def _start_world_plugins(state: SimulationState, mask: np.ndarray) -> None:
    for world_binding in state.world_bindings:
        if type(world_binding.plugin).start is WorldPlugin.start:
            continue
        if mask.all():
            _start(world_binding, world_binding.view)
        else:
            call_world_plugin(state.population, world_binding, mask, _start)
    apply_moves(state, 0.0)


def _start(world_binding: WorldBinding, view: WorldView) -> None:
    view.begin(world_binding.plugin)
    try:
        world_binding.plugin.start(view)
    except Exception as error:
        raise failure.in_call(error, world_binding.plugin, view) from error


def _create(state: SimulationState, due: Mapping[int, np.ndarray], at_start: bool = False) -> Bodies | None:
    """Create the entities that are due, at positions that no interaction rejects; None if none are due.

    Args:
        state: The simulation; its body table is not changed.
        due: Block number -> world of each entity, (m,).
        at_start: The worlds are being reset.
    """
    rejecting = _rejecting(state)
    placed: dict[int, list[np.ndarray]] = {}

    def occupied(world: int) -> np.ndarray:
        bodies = state.population.bodies
        # At a reset, the table still holds the rows of the previous episode.
        here = [] if at_start else [bodies.pos[:, bodies.world == world]]
        return np.concatenate([np.zeros((3, 0)), *here, *placed.get(world, [])], axis=1)

    def rejects(world: int, pos: np.ndarray, others: np.ndarray) -> bool:
        return bool(_who_rejects(rejecting, world, pos, others))

    def fail(world: int, error: MissionError) -> None:
        if at_start and state.n_worlds == 1:
            raise error
        state.record_failure(world, state.error(world, str(error)))

    occupancy = Occupancy(rejects, occupied, fail, step=state.context.clock.step) if rejecting else None
    state.world_view.begin()
    new, first = Bodies.empty(sum(map(len, due.values())), state.n_worlds), 0
    is_there = np.ones(new.n, bool)
    for block, worlds in due.items():
        rows = slice(first, first := first + len(worlds))
        state.births.create(new, rows, block, worlds, occupancy=occupancy)
        if occupancy is not None:
            for waiting in occupancy.waiting:
                is_there[waiting] = False
            for world in np.unique(worlds):
                mine = (worlds == world) & is_there[rows]
                placed.setdefault(int(world), []).append(new.pos[:, rows][:, mine])
    if not is_there.all():
        kept = np.flatnonzero(is_there)
        new = Bodies(new.floats.take(kept, axis=1), new.ints.take(kept, axis=1), new.n_worlds)
    return in_order(new) if new.n or (at_start and due) else None


def _rejecting(state: SimulationState) -> list[WorldBinding]:
    return [r for r in state.interactions if type(r.plugin).rejects is not Interaction.rejects]


def _who_rejects(rejecting: list[WorldBinding], world: int, pos: np.ndarray, taken: np.ndarray) -> str:
    names = (r.spec.instance_name for r in rejecting if r.plugin.rejects(r.view, world, pos, taken))
    return next(names, "")


def who_rejects(state: SimulationState, world: int, pos: np.ndarray) -> str:
    """Return the name of the interaction that rejects an entity at a position [m], (3,), of a world as it is now; "" if none does."""
    bodies = state.population.bodies
    return _who_rejects(_rejecting(state), world, pos, bodies.pos[:, bodies.world == world])


def spawn_due(state: SimulationState) -> None:
    """Add the entities that are due, and those that plugins have spawned, at the beginning of a step."""
    parts, births = [], state.births
    requests, state.world_view.births = state.world_view.births, []
    if requests:
        _check_space(state, np.concatenate([request["world"] for request in requests]))
    is_open = state.running & ~state.failed
    for request in requests:
        where = {k: v for k, v in request.items() if k not in ("block", "world")}
        worlds = request["world"]
        order = np.argsort(worlds, kind="stable")
        kept = order[is_open[worlds[order]]]
        if len(kept):
            where = {k: v[..., kept] for k, v in where.items()}
            block = state.context.block_names.index(request["block"])
            new = Bodies.empty(len(kept), state.n_worlds)
            births.create(new, slice(0, new.n), block, worlds[kept], where)
            parts.append(new)
    due = births.due(state.context.clock.t, state.running) if births.has_rates else {}
    born = _create(state, due) if due else None
    parts += [born] if born is not None else []
    if parts:
        repack(state, None, joined(parts))
        remove_dead(state)  # handles that could not be opened fail their worlds


def _check_space(state: SimulationState, worlds: np.ndarray) -> None:
    """Fail the worlds that would exceed their size limit with the spawned entities of `worlds`, (m,)."""
    n_requested = np.bincount(worlds, minlength=state.n_worlds)
    space = state.births.space(np.bincount(state.population.bodies.world, minlength=state.n_worlds))
    limits, update = state.mission.limits, state.mission.update
    for world in map(int, np.flatnonzero(state.running & (n_requested > space))):
        text = (
            f"plugins spawn {n_requested[world]:,} more entities, but only {max(0, space[world]):,} are allowed: with update={update!r} "
            f"the limit of a world is {limits.most_rows(update):,}; allow_large raises it, for missions that you trust"
        )
        state.record_failure(world, state.error(world, text))
