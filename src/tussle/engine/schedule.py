"""The schedule: the calls of a step, in order, composed once."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np

from tussle.api.kinds import WorldPlugin
from tussle.declare.columns import Subscribe
from tussle.engine import failure
from tussle.engine.calls import Call
from tussle.engine.delivery import deliver
from tussle.engine.group import Binding, Group
from tussle.engine.manual import manual_calls
from tussle.engine.rows import apply_moves
from tussle.engine.state import SimulationState
from tussle.engine.steering import Steering, steering_of
from tussle.engine.step_end import end_step
from tussle.engine.subset import call_group, call_world_plugin
from tussle.engine.world_bindings import WorldBinding
from tussle.errors import PluginError
from tussle.mission.cadence import Cadence, TimerCadence
from tussle.mission.spec import SHUFFLED
from tussle.numeric import rng
from tussle.numeric.rng import stream_key

ORDER = int(stream_key("update", "order"))


def compose(state: SimulationState) -> list[Call]:
    """Return all calls of a step, in order.

    An entity plugin is called once for all rows of its group, a world plugin once for all worlds. If the clocks of the worlds differ,
    a plugin with a rate is called for the worlds in which it is due. An exception ends the stack with a `PluginError`.

    Raises:
        MissionError: The rate of a plugin does not fit the step.
    """
    calls: list[Call] = []
    groups, bodies = state.population.groups, state.population.bodies
    if any(r.plugin.reads_start_positions for r in state.world_bindings):
        calls.append(Call("keep positions", partial(_keep_positions, state)))
    if state.population.is_sequential:
        # As in the paper's code, which indexes the positions once per step: an entity that has moved is seen where it is by those in
        # whose range it was at the start of the step.
        calls.append(Call("index start positions", bodies.keep_start))
        turns = []
        for group in groups:
            decides = [_entity_call(state, "autonomy", group, b) for b in group.autonomies]
            takes, returns = manual_calls(state, group)
            turns.append((group, [*decides, *takes, *_motion(state, [group]), *returns]))
        if state.mission.update in SHUFFLED:
            names = dict.fromkeys(name for _, own in turns for call in own for name in call.names)
            calls.append(Call("each entity in random order", partial(_take_turns, state, turns), (*names,)))
        else:
            calls += [call for _, own in turns for call in own]
        calls.append(Call("index current positions", bodies.end_start))
    else:
        for group in groups:
            calls += [_entity_call(state, "autonomy", group, b) for b in group.autonomies]
        manual = [manual_calls(state, group) for group in groups]
        calls += [call for takes, _ in manual for call in takes]
        calls += _motion(state, groups)
        calls += [call for _, returns in manual for call in returns]
    for group in groups:
        calls += [_entity_call(state, "sensor", group, b) for b in group.sensors]
    if state.interactions:
        calls.append(Call("reset forces", bodies.clear_loads))
    calls += [_world_call(state, "interaction", r) for r in state.interactions if steps(r)]
    if state.interactions:
        calls.append(Call("apply moves", partial(apply_moves, state)))
    calls += [_world_call(state, "metric", r) for r in state.metrics if steps(r)]
    if state.events:
        report = partial(state.events.messages, state.world_view)
        calls.append(Call("report captures and collisions", report))
    # Always needed, since `Simulation.publish` may create topics.
    calls.append(Call("deliver messages", partial(deliver, state)))
    calls.append(Call("check, remove, end", partial(end_step, state)))
    return calls


def _take_turns(state: SimulationState, turns: list[tuple[Group, list[Call]]]) -> None:
    """Let the entities of the only world decide and move in an order that is drawn by its seed and step."""
    places = np.array([group.place for group, _ in turns], np.int64)
    state.context.has_chance = True
    chance = rng.uniform(state.context.keys[:1], ORDER, places, state.context.clock.step[:1])[0]
    in_blocks = state.mission.update == "random_in_blocks"
    names = state.context.block_names
    block = np.array([names.index(group.names[0]) if in_blocks else 0 for group, _ in turns], np.int64)
    for k in np.lexsort((places, chance, block)):
        for call in turns[k][1]:
            call.run()


def _keep_positions(state: SimulationState) -> None:
    state.world_view.start_pos = state.population.bodies.pos.copy()


def _motion(state: SimulationState, groups: list[Group]) -> list[Call]:
    dt, m = state.mission.dt, state.mission.motion_multiplier
    calls = [_advance_call(state, g, dt, m, 0.0) for g in groups if not g.controllers]
    steered = [g for g in groups if g.controllers]
    is_split = state.by_substep or (m > 1 and state.mission.compat)  # see `_entity_call`
    steerings = [None if is_split else steering_of(g) for g in steered]
    if None not in steerings:  # otherwise a controller may read other entities, which move in each substep
        return calls + [_steering_call(state, steering, dt / m, m) for steering in steerings if steering]
    for s in range(m if steered else 0):
        for group in steered:
            calls += [_entity_call(state, "controller", group, b, s) for b in group.controllers]
        calls += [_advance_call(state, g, dt / m, 1, s / m) for g in steered]
    return calls


def _due(
    state: SimulationState, cadence: Cadence | TimerCadence, substep: int = 0
) -> Iterator[tuple[int, np.ndarray | None]]:
    """Yield the number of grid points since the last call and the worlds, (n_worlds,), in which a plugin is due; None for all."""
    clock, running = state.context.clock, state.running
    if clock.common >= 0:
        if since := cadence.since(clock.common, substep):
            yield since, None
        return
    found: dict[int, np.ndarray] = {}
    for step in np.unique(clock.step[running]):
        if since := cadence.since(int(step), substep):
            found.setdefault(since, np.zeros(len(running), bool))[running & (clock.step == step)] = True
    yield from sorted(found.items())


def _advance_call(state: SimulationState, group: Group, dt: float, substeps: int, phase: float) -> Call:
    view, plugin, await_ready = group.motion_view, group.motion.plugin, _waits_for(group, group.motion)

    def run() -> None:
        if group.n:
            if await_ready:
                await_ready()
            # Inlined `view.begin`, here and below: calling it takes 1 % of a small step.
            view._caller, view.phase = plugin, phase
            try:
                group.advance(dt, substeps)
            except Exception as error:
                raise failure.in_call(error, plugin, view, group) from error

    label, names = _label(state, "motion", group, group.motion), _names("motion", group.motion)
    is_joined = _only_calls_kernels(state, group.motion) and not (await_ready or group.stacks_inputs)
    return Call(label, run, names, (view,) if is_joined else ())


def _steering_call(state: SimulationState, steering: Steering, dt: float, substeps: int) -> Call:
    group = steering.group
    view, plugin, body = group.controller_view, group.controllers[0].plugin, group.motion_view

    def run() -> None:
        if group.n:
            view._caller, view.substep, view.phase, view.dt = plugin, 0, 0.0, dt
            body._caller, body.phase = group.motion.plugin, 1.0 - 1.0 / substeps
            try:
                steering.run(dt, substeps)
            except Exception as error:
                raise failure.in_call(error, plugin, view, group) from error

    place = f" {group.place}" if state.population.is_sequential else ""
    plugins = [b.spec.instance_name for b in (*group.controllers, group.motion)]
    label = f"{'control, move':<12} {group.name}{place}: {', '.join(plugins)}, {substeps} substeps in one"
    is_joined = steering.ranged is None and _only_calls_kernels(state, group.motion)
    return Call(label, run, ("controller", "motion", *plugins), (view, body) if is_joined else ())


def _entity_call(state: SimulationState, kind: str, group: Group, binding: Binding, substep: int = 0) -> Call:
    mission, path = state.mission, binding.path
    m = mission.motion_multiplier if kind == "controller" else 1
    # SCRIMMAGE passes the dt of a step to every call, also to controllers in each substep.
    grid_dt = mission.dt if mission.compat else mission.dt / m
    phase = substep / m if kind == "controller" else float(kind == "sensor")
    cadence: Cadence | TimerCadence | None = Cadence.of(
        binding.spec, m / mission.dt, m, f"block {group.names[0]!r}"
    )
    if cadence is not None and mission.compat:
        cadence = TimerCadence(binding.spec.rate, mission.dt, m)
    inboxes = [
        b.plugin.__dict__[k]
        for b in binding.walk()
        for k, c in type(b.spec).columns.items()
        if isinstance(c, Subscribe)
    ]
    is_linked = any(b.links for b in binding.walk())
    await_ready = _waits_for(group, binding)
    view, plugin = binding.view, binding.plugin

    def call(some: Group, own: Binding, dt: float) -> None:
        view = own.view
        view._caller, view.substep, view.phase, view.dt = own.plugin, substep, phase, dt
        try:
            if is_linked:
                own.pull(some.table)
            own.plugin.step(view)
            if is_linked:
                own.push(some.table)
        except Exception as error:
            raise failure.in_call(error, own.plugin, view, some) from error

    def call_part(dt: float) -> Callable[[Group], None]:
        return lambda some: call(some, next(b for b in some.bindings if b.path == path), dt)

    def run() -> None:
        calls = [(1, None)] if cadence is None else list(_due(state, cadence, substep))
        if await_ready and group.n and calls:
            await_ready()
        for since, worlds in calls:
            if group.n:
                if worlds is None:
                    call(group, binding, since * grid_dt)
                else:
                    call_group(state.population, group, worlds, call_part(since * grid_dt))
            # Also if the group has no rows: entities born later do not receive older messages.
            for inbox in inboxes:
                inbox.clear(worlds)

    def run_plain() -> None:
        if group.n:
            view._caller, view.substep, view.phase, view.dt = plugin, substep, phase, grid_dt
            try:
                plugin.step(view)
            except Exception as error:
                raise failure.in_call(error, plugin, view, group) from error

    is_plain = cadence is None and not (inboxes or await_ready or is_linked)
    label = _label(state, kind, group, binding, substep)
    is_joined = is_plain and kind == "autonomy" and _only_calls_kernels(state, binding)
    return Call(label, run_plain if is_plain else run, _names(kind, binding), (view,) if is_joined else ())


def _only_calls_kernels(state: SimulationState, binding: Binding) -> bool:
    """Whether all that a plugin does in a step is to call kernels, in one thread, with the same arguments while rows stay the same.

    Lists are in other arrays whenever they are written.
    """
    is_alone = state.context.threads == 1 and not state.population.is_sequential
    return is_alone and all(
        vars(type(b.plugin)).get("only_calls_kernels") and not (b.handles or b.ragged) for b in binding.walk()
    )


def _names(kind: str, binding: Binding | WorldBinding) -> tuple[str, ...]:
    return kind, binding.spec.instance_name


def _waits_for(group: Group, binding: Binding) -> Callable[[], None] | None:
    """Return a function that waits until all handles of a plugin are ready; None if the plugin never waits."""
    waiting = [b for b in binding.walk() if b.handles and hasattr(type(b.spec), "ready")]

    def wait() -> None:
        for each in waiting:
            longest = max(handle.ready_timeout for handle in type(each.spec).handles().values())
            limit = time.monotonic() + longest
            try:
                while not each.plugin.ready(each.view):
                    if time.monotonic() > limit:
                        raise PluginError(f"was not ready within {longest:g} s")
                    time.sleep(0.001)
            except Exception as error:
                raise failure.in_call(error, each.plugin, each.view, group) from error

    return wait if waiting else None


def _world_call(state: SimulationState, kind: str, world_binding: WorldBinding) -> Call:
    dt = state.mission.dt
    cadence = Cadence.of(world_binding.spec, 1.0 / dt, 1, "mission")

    def call(some: WorldBinding, w: Any, dt: float) -> None:
        w._caller, w.phase, w.dt = some.plugin, 1.0, dt
        try:
            some.plugin.step(w)
        except Exception as error:
            raise failure.in_call(error, some.plugin, w, None) from error

    label = f"{kind:<12} {world_binding.spec.instance_name}{_rate_text(world_binding.spec)}"
    if cadence is None:
        return Call(label, partial(call, world_binding, world_binding.view, dt), _names(kind, world_binding))

    def call_part(dt: float) -> Callable[[WorldBinding, Any], None]:
        return lambda some, w: call(some, w, dt)

    def run() -> None:
        for since, worlds in _due(state, cadence):
            if worlds is None:
                call(world_binding, world_binding.view, since * dt)
            else:
                call_world_plugin(state.population, world_binding, worlds, call_part(since * dt))

    return Call(label, run, _names(kind, world_binding))


def _label(state: SimulationState, kind: str, group: Group, binding: Binding, substep: int = 0) -> str:
    m = state.mission.motion_multiplier
    part = f" ({substep + 1}/{m})" if kind == "controller" and m > 1 else ""
    place = f" {group.place}" if state.population.is_sequential else ""
    return f"{kind:<12} {group.name}{place}: {binding.spec.instance_name}{_rate_text(binding.spec)}{part}"


def steps(world_binding: WorldBinding) -> bool:
    """Return True if a world plugin overrides `step`."""
    return type(world_binding.plugin).step is not WorldPlugin.step


def _rate_text(plugin: Any) -> str:
    return f" at {plugin.rate:g} Hz" if plugin.rate is not None else ""
