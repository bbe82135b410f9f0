"""The end of a step: check states, remove dead entities, advance clocks, end worlds."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from tussle.api import Interaction, kernels
from tussle.api.bodies import Bodies
from tussle.engine import failure
from tussle.engine.kernels import mark_teams
from tussle.engine.result import WorldResult
from tussle.engine.rows import repack
from tussle.engine.snapshot import state_hash
from tussle.engine.state import Parked, SimulationState


def end_step(state: SimulationState) -> None:
    """Check all states, advance the clocks, remove dead entities, end worlds."""
    context, clock = state.context, state.context.clock
    if context.threads == 1:
        found = kernels.check(*state.checked, (0, state.population.bodies.n))
    else:
        counts: list[int] = []
        context.split(
            len(state.checked[-1]),
            lambda *part: counts.append(kernels.check(*state.checked, part)),
            least=4096,
        )
        found = sum(counts)
    if found:
        _record_faults(state)
    if state.n_running == state.n_worlds:
        clock.step += 1
    else:
        clock.step += state.running
    if state.world_view.deaths or state.has_failures:
        remove_dead(state)
    if clock.common >= 0:
        clock.common += 1
    if state.has_changed or clock.common < 0 or clock.common >= state.n_steps:
        _end_worlds(state)


def _record_faults(state: SimulationState) -> None:
    """Fail the worlds that have non-finite states, and kill entities without health."""
    bodies, faulty = state.population.bodies, state.checked[-1]
    for row in map(int, np.flatnonzero(faulty)):
        world = int(bodies.world[row])
        if not state.failed[world]:
            group = next(g for g in state.population.groups if g.first <= row < g.last)
            step = int(state.context.clock.step[world])
            names = [b.spec.instance_name for b in state.world_bindings if isinstance(b.spec, Interaction)]
            state.record_failure(world, failure.not_finite(group, bodies, row, step, names))
    state.world_view.kill(~faulty & ~(bodies.health > 0.0), "health")


def remove_dead(state: SimulationState) -> None:
    """Remove dead entities, and all entities of worlds that have failed."""
    view, bodies = state.world_view, state.population.bodies
    if not view.deaths and not state.has_failures:
        return
    ended = state.failed & state.running
    state.has_failures = False
    gone = np.zeros(bodies.n, bool)
    for rows, _ in view.deaths:
        gone[rows] = True
    if state.events and view.deaths:
        state.events.deaths(bodies, view.deaths, np.maximum(state.context.clock.step - 1, 0))
    view.deaths = []
    for world in np.flatnonzero(ended):
        _end(state, int(world), "error")
        gone |= bodies.world == world
    repack(state, gone, None)


def _end_worlds(state: SimulationState) -> None:
    over: dict[int, str] = {}
    if "time" in state.mission.end_conditions:
        for world in np.flatnonzero(state.running & (state.context.clock.step >= state.n_steps)):
            over[int(world)] = "time"
    # Births matter too: after the last birth, a single team may be left.
    if state.has_changed:
        state.has_changed = False
        state.population.settle()
        for number, reason in _lost_teams(state):
            over.setdefault(number, reason)
    if over:
        _end_and_park(state, over)


def _lost_teams(state: SimulationState) -> Iterable[tuple[int, str]]:
    conditions = state.mission.end_conditions
    if "none" in conditions or not {"one_team", "all_dead"} & set(conditions):
        return
    bodies, teams = state.population.bodies, state.context.teams
    has_team = np.zeros((state.n_worlds, len(teams)), bool)
    mark_teams(bodies.world, bodies.team, teams, has_team)
    left = has_team.sum(axis=1)
    # SCRIMMAGE considers only living entities: neither future births nor the teams at the start.
    is_historic = bool(state.mission.compat)
    for world in np.flatnonzero(state.running & (left <= 1)):
        if not (is_historic or state.births.is_over(int(world))):
            continue
        if left[world] == 0:
            yield int(world), "all_dead"
        elif "one_team" in conditions and (is_historic or len(teams) > 1):
            yield int(world), "one_team"


def _end_and_park(state: SimulationState, over: Mapping[int, str]) -> None:
    bodies = state.population.bodies
    for world, reason in over.items():
        _end(state, world, reason)
    if state.n_running:
        repack(state, np.isin(bodies.world, list(over)), None)
        mask = np.zeros(state.n_worlds, bool)
        mask[list(over)] = True
        state.message_bus.drop_worlds(mask)
    else:
        state.population.close_handles()


def _end(state: SimulationState, world: int, reason: str) -> None:
    result = world_result(state, world, reason)
    previous = state.results[world]
    if previous is not None:
        result.error = previous.error
    state.results[world] = result
    state.parked[world] = _park(state, world)
    state.running[world] = False
    state.n_running = int(state.running.sum())
    if state.events:
        state.events.end(world, reason)


def _park(state: SimulationState, world: int) -> Parked:
    """Copy the rows of a world that ends, before they are removed from the table."""
    bodies = state.population.bodies
    rows = np.flatnonzero(bodies.world == world)
    tables = {}
    for group in state.population.groups:
        mine = np.flatnonzero((rows >= group.first) & (rows < group.last))
        if len(mine):
            tables[group.key] = mine, group.table.take(rows[mine] - group.first)
    of_world = {b.spec.instance_name: b.take(rows, world) for b in state.world_bindings}
    own = Bodies(bodies.floats[:, rows].copy(), bodies.ints[:, rows].copy(), bodies.n_worlds)
    return Parked(own, tables, of_world)


def world_result(state: SimulationState, world: int, reason: str, is_hashed: bool = True) -> WorldResult:
    """Return the result of a world at its current step. The state hash is optional, since it takes longer than the rest."""
    bodies = state.population.bodies
    here = bodies.team[bodies.world == world]
    alive = {int(team): int((here == team).sum()) for team in state.context.teams}
    clock = state.context.clock
    steps = int(clock.step[world])
    result = WorldResult(world, int(state.context.seeds[world]), reason, steps, float(clock.t[world]), alive)
    result.born = dict.fromkeys(alive, 0)
    for block, n in zip(state.mission.blocks, state.births.n_born[:, world], strict=True):
        result.born[block.team] += int(n)
    result.waited = int(state.births.n_waited[:, world].sum())
    scores: dict[int, float] = {}
    for world_binding in state.world_bindings:
        world_binding.view.begin(world_binding.plugin)
        try:
            found = world_binding.plugin.result_of(world_binding.view, world)
        except Exception as error:
            if reason == "error":  # may be a consequence of the earlier failure
                continue
            raise failure.raised(
                error, world_binding.plugin, where="result", step=steps, world=world
            ) from error
        if found:
            result.metrics[world_binding.spec.instance_name] = found
        for team, score in (found.get("score") or {}).items() if world_binding in state.metrics else ():
            scores[team] = scores.get(team, 0.0) + score
    result.scores = scores
    if is_hashed:
        result.state_hash = state_hash(state, world)
    return result
