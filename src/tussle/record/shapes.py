"""Shapes drawn by plugins, as rows of a table."""

from __future__ import annotations

import json
import math
import sys
from typing import Any

import numpy as np
import pyarrow as pa

from tussle.record.arrow_values import arrow_array
from tussle.record.schema import SHAPES


class ShapeRows:
    """Collects what plugins draw, one row per world that sees it, until `close`.

    Args:
        sim: The simulation, see `recorder.Recorded`.

    Attributes:
        n_characters: Length of the rows that are collected, in characters.
    """

    def __init__(self, sim: Any) -> None:
        self._sim, self._context = sim, sim.state.context
        self._rows: list[tuple[Any, ...]] = []
        self.n_characters = 0
        self._context.draw.sinks.append(self._add)

    def _add(self, kind: str, attributes: dict[str, Any]) -> None:
        if self._sim.events.is_replaying:  # these steps were recorded when they were played first
            return
        clock = self._context.clock
        for world in np.flatnonzero(self._sim.state.running):
            kept = attributes_in(attributes, int(world))
            if kept is not None:
                step = int(clock.step[world])
                text = json.dumps(kept, default=_plain)
                self.n_characters += len(text)
                t = clock.start + step * clock.dt
                self._rows.append((int(world), t, step, kind, lifetime_of(attributes), text))

    def take(self) -> pa.RecordBatch | None:
        """Return the rows so far, and forget them; None where there are none."""
        rows, self._rows, self.n_characters = self._rows, [], 0
        if not rows:
            return None
        arrays = [
            arrow_array(column, f.type) for column, f in zip(zip(*rows, strict=True), SHAPES, strict=True)
        ]
        return pa.RecordBatch.from_arrays(arrays, schema=SHAPES)

    def close(self) -> None:
        """Collect no more. A second call does nothing."""
        if self._add in self._context.draw.sinks:
            self._context.draw.sinks.remove(self._add)


def attributes_in(attributes: dict[str, Any], world: int) -> dict[str, Any] | None:
    """Return a copy of a shape's attributes for one world; None if the shape is not seen there."""
    copied = {k: v.copy() if isinstance(v, np.ndarray) else v for k, v in attributes.items()}
    where = copied.pop("world", None)
    if where is None:
        return copied
    chosen = np.asarray(where) == world
    if chosen.ndim == 0:
        return copied if chosen else None
    if not chosen.any():
        return None
    n = len(chosen)
    return {
        k: v[..., chosen] if isinstance(v, np.ndarray) and v.ndim and v.shape[-1] == n else v
        for k, v in copied.items()
    }


def lifetime_of(attributes: dict[str, Any]) -> float:
    """Return how long a shape is seen after its step [s]; 0 for an invalid value: a drawing must not stop its game."""
    try:
        seconds = float(attributes.get("lifetime", 0.0))
    except (TypeError, ValueError):
        return 0.0
    return 0.0 if math.isnan(seconds) else min(max(seconds, 0.0), sys.float_info.max)


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, (np.ndarray, np.generic)) else repr(value)
