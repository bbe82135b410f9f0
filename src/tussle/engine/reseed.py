"""Switch to another seed at the mission's `reseed_time`."""

from __future__ import annotations

import numpy as np

from tussle.engine.state import SimulationState
from tussle.numeric.rng import stream_key

DERIVED = np.uint64(stream_key("reseed"))


def renew_keys(state: SimulationState) -> None:
    """Set the random keys of all worlds for the step that begins. The keys depend only on its time."""
    mission, context = state.mission, state.context
    if mission.reseed_time is None:
        return
    other = context.seeds ^ DERIVED if mission.reseed is None else np.uint64(mission.reseed)
    is_due = context.clock.t >= mission.reseed_time - 1e-6 * mission.dt
    keys = np.where(is_due, other, context.seeds)
    if (keys != context.keys).any():
        context.keys[:] = keys
        for group in state.population.groups:
            for view in group.views:
                view.renew()
