"""Random keys that change during a game: at the mission's `reseed_time`, and at the steps of its branches."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from tussle.api.context import Redraw
from tussle.engine.state import SimulationState
from tussle.mission.rekeys import BIRTH, Rekeys, RekeyTarget, check_targets, checked_rekeys
from tussle.numeric.rng import stream_key

DERIVED = np.uint64(stream_key("reseed"))


def set_rekeys(state: SimulationState, worlds: Iterable[int], rekeys: Sequence[Rekeys] | None) -> None:
    """Set the re-keys of worlds that are reset, by default those of the mission; those of births hold until the first step.

    Raises:
        MissionError: They are not in order of their steps, or a number or target is not allowed.
    """
    own, redraws = state.mission.rekeys, state.context.redraws
    for i, world in enumerate(worlds):
        state.rekeys.pop(world, None)
        redraws[:] = [redraw for redraw in redraws if redraw.world != world]
        if chosen := own if rekeys is None else checked_rekeys(rekeys[i]):
            check_targets(chosen, *state.mission.draws)
            state.rekeys[world] = chosen
            targets = [(key, RekeyTarget.parse(text)) for _, key, *texts in chosen for text in texts]
            redraws += [
                _redraw(state, world, key, target._replace(plugin=""))
                for key, target in targets
                if target.plugin == BIRTH
            ]


def renew_keys(state: SimulationState) -> None:
    """Set the random keys of all worlds for the step that begins. The keys depend only on its time, and on re-keys of earlier steps."""
    mission, context = state.mission, state.context
    if mission.reseed_time is None and not state.rekeys:
        return
    keys = context.seeds.copy()
    if mission.reseed_time is not None:
        other = context.seeds ^ DERIVED if mission.reseed is None else np.uint64(mission.reseed)
        keys = np.where(context.clock.t >= mission.reseed_time - 1e-6 * mission.dt, other, keys)
    _use(state, keys, 0)


def branch_keys(state: SimulationState) -> None:
    """Set the keys of worlds that branch in this step: after its births and observers, so that what they have seen stays."""
    _use(state, state.context.keys.copy(), 1)


def _use(state: SimulationState, keys: np.ndarray, ahead: int) -> None:
    """Let worlds draw with their keys, and with those of their re-keys of earlier steps than this one, or than the one `ahead`."""
    context, redraws = state.context, []
    for world, rekeys in state.rekeys.items():
        own: list[Redraw] = []
        for step, key, *target in rekeys:
            if step >= context.clock.step[world] + ahead:
                break
            if target:
                own += [
                    _redraw(state, world, key, each)
                    for each in map(RekeyTarget.parse, target)
                    if each.plugin != BIRTH
                ]
            else:
                keys[world] = key
                own.clear()
        redraws += own
    context.redraws[:] = redraws
    if (keys != context.keys).any():
        context.keys[:] = keys
        for group in state.population.groups:
            for view in group.views:
                view.renew()


def _redraw(state: SimulationState, world: int, key: int, target: RekeyTarget) -> Redraw:
    names = state.context.block_names
    if target.owner in names:
        block = names.index(target.owner)
        return Redraw(world, np.uint64(key), block, target.number - 1, target.plugin, target.label)
    return Redraw(world, np.uint64(key), -1, -1, target.owner, target.label)
