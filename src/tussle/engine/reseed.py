"""Random keys that change during a game: at the mission's `reseed_time`, and at the steps of its branches."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from tussle.engine.state import SimulationState
from tussle.mission.rekeys import Rekeys, checked_rekeys
from tussle.numeric.rng import stream_key

DERIVED = np.uint64(stream_key("reseed"))


def set_rekeys(state: SimulationState, worlds: Iterable[int], rekeys: Sequence[Rekeys] | None) -> None:
    """Set the re-keys of worlds that are reset; by default those of the mission.

    Raises:
        MissionError: They are not in order of their steps, or a number is not allowed.
    """
    own = state.mission.rekeys
    for i, world in enumerate(worlds):
        state.rekeys.pop(world, None)
        if chosen := own if rekeys is None else checked_rekeys(rekeys[i]):
            state.rekeys[world] = chosen


def renew_keys(state: SimulationState) -> None:
    """Set the random keys of all worlds for the step that begins. The keys depend only on its time, and on re-keys of earlier steps."""
    mission, context = state.mission, state.context
    if mission.reseed_time is None and not state.rekeys:
        return
    keys = context.seeds.copy()
    if mission.reseed_time is not None:
        other = context.seeds ^ DERIVED if mission.reseed is None else np.uint64(mission.reseed)
        keys = np.where(context.clock.t >= mission.reseed_time - 1e-6 * mission.dt, other, keys)
    for world, rekeys in state.rekeys.items():
        for step, key in rekeys:
            if step < context.clock.step[world]:
                keys[world] = key
    _use(state, keys)


def branch_keys(state: SimulationState) -> None:
    """Set the keys of worlds that branch in this step: after its births and observers, so that what they have seen stays."""
    keys, steps = state.context.keys.copy(), state.context.clock.step
    for world, rekeys in state.rekeys.items():
        for step, key in rekeys:
            if step == steps[world]:
                keys[world] = key
    _use(state, keys)


def _use(state: SimulationState, keys: np.ndarray) -> None:
    context = state.context
    if (keys != context.keys).any():
        context.keys[:] = keys
        for group in state.population.groups:
            for view in group.views:
                view.renew()
