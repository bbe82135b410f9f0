"""Calls of a plugin inside another one for some rows only."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from tussle.declare.columns import EntityRef, Handle, Output, State
from tussle.declare.comms import Publisher
from tussle.declare.messages import Messages


def step_some(plugin: Any, view: Any, active: np.ndarray) -> None:
    """Step a plugin; for rows where active, (n,), is false its columns keep their values and its messages are withdrawn."""
    idle = np.flatnonzero(~active)
    restore = [_holder(own, idle) for own in plugin.walk()]
    topics = {p.topic for own in plugin.walk() for p in own.__dict__.values() if isinstance(p, Publisher)}
    sent = [(topic, len(topic.sent)) for topic in topics]

    def is_from_active(batch: Messages) -> np.ndarray:
        kept: np.ndarray = active[view.bodies_rows(batch.world, batch.sender) - view.first]
        return kept

    plugin.step(view)
    for each in restore:
        each()
    for topic, first in sent:
        topic.retain(first, is_from_active)


def restart(plugin: Any, view: Any, rows: np.ndarray) -> None:
    """Set the states of a plugin to their defaults for some rows, (m,), and call `spawn` for them; handles and outputs stay."""
    for own in plugin.walk():
        for name, column in type(own).columns.items():
            held = own.__dict__.get(name)
            if held is not None and isinstance(column, (State, EntityRef)):
                if column.ragged:
                    held.put(rows, held.take(np.full(len(rows), -1)))
                else:
                    held[..., rows] = np.reshape(column.default, (-1, 1))
        own.spawn(view, rows)


def _holder(plugin: Any, rows: np.ndarray) -> Callable[[], None]:
    """Save what a plugin may write in some rows, (m,). Returns a function that restores it."""
    saved: list[tuple[Any, Any, bool]] = []
    objects: list[tuple[list[Any], list[Any]]] = []
    for name, column in type(plugin).columns.items():
        held = plugin.__dict__.get(name)
        if held is not None and isinstance(column, (State, EntityRef, Output)):
            saved.append((held, held.take(rows) if column.ragged else held[..., rows], column.ragged))
        elif isinstance(column, Handle):
            objects.append((held, [held[i] for i in rows]))

    def restore() -> None:
        for held, values, is_ragged in saved:
            if is_ragged:
                held.put(rows, values)
            else:
                held[..., rows] = values
        for own, kept in objects:
            for i, one in zip(rows, kept, strict=True):
                own[i] = one

    return restore
