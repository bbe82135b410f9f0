"""Changes of the body table's rows: births, removals and moves, passed on to all views and plugins."""

from __future__ import annotations

import numpy as np

from tussle.api.bodies import Bodies
from tussle.engine import failure
from tussle.engine.state import SimulationState


def repack(state: SimulationState, gone: np.ndarray | None, new: Bodies | None) -> None:
    """Remove rows (gone, (n,), true) and add newborn ones."""
    bodies = state.population.bodies
    ints = bodies.ints
    index, newborn = state.population.repack(gone, new)
    if bodies.ints is ints:
        state.world_view.renew()
        state.has_changed = True
    else:
        rows_changed(state)
    for world_binding in state.world_bindings:
        world_binding.rearrange(index)
    if new is not None:
        state.population.begin_rows(newborn)
        if state.events:
            state.events.births(new)


def rows_changed(state: SimulationState) -> None:
    """Update views and checks after the table has been repacked or restored."""
    b = state.population.bodies
    state.world_view.reset(b, 0, b.n)
    state.checked = b.pos, b.quat, b.health, np.empty(b.n, bool)
    state.has_changed = True


def place(state: SimulationState, rows: np.ndarray, **body: np.ndarray) -> None:
    """Place entities, see `WorldView.move`, and let their motion models go on from there at once, at the beginning of a step."""
    state.world_view.move(rows, **body)
    apply_moves(state, 0.0)


def apply_moves(state: SimulationState, phase: float = 1.0) -> None:
    """Let motion models set their states where world plugins have moved entities. Sensors update beliefs when next called."""
    view = state.world_view
    if not view.moved:
        return
    is_moved = np.zeros(state.population.bodies.n, bool)
    is_moved[np.concatenate(view.moved)] = True
    rows = np.flatnonzero(is_moved)
    view.moved = []
    for group in state.population.groups:
        mine = rows[(rows >= group.first) & (rows < group.last)] - group.first
        if len(mine):
            group.motion_view.begin(group.motion.plugin, phase)
            try:
                group.from_body(mine)
            except Exception as error:
                raise failure.in_call(error, group.motion.plugin, group.motion_view, group) from error
