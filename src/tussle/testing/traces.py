"""The states of each world of the conformance kit's game, step by step."""

from __future__ import annotations

from typing import Any

import numpy as np

from tussle.engine.simulation import Simulation
from tussle.engine.snapshot import hashed
from tussle.errors import ConformanceError
from tussle.testing.game import SEEDS, STEPS, ConformanceGame

Columns = list[tuple[str, Any]]


def columns_of(sim: Simulation, world: int) -> Columns:
    """All data of one world: (name, values); of a world that has ended, its result."""
    done = sim.state.results[world]
    if done is not None and not sim.state.running[world]:
        parts = (done.end, done.steps, done.t, done.alive, done.metrics, done.scores, done.state_hash)
        return [("result", repr(parts).encode())]
    return [
        (name, values if isinstance(values, bytes) else np.array(values))
        for name, values in hashed(sim.state, world)
    ]


def first_difference(expected: Columns, found: Columns) -> str:
    """Description of the first column that differs in a bit; "" if all are equal."""
    for (name, a), (_, b) in zip(expected, found, strict=False):
        if name == "result" and a != b:
            return f"{name}: {a.decode()} versus {b.decode() if isinstance(b, bytes) else b}"
        data = [v if isinstance(v, bytes) else v.tobytes() for v in (a, b)]
        if data[0] != data[1]:
            if isinstance(a, bytes) or isinstance(b, bytes) or a.shape != b.shape or a.dtype != b.dtype:
                return f"{name}: {_shape(a)} versus {_shape(b)}"
            items = [np.frombuffer(d, np.uint8).reshape(a.size, -1) for d in data]
            item = int(np.flatnonzero((items[0] != items[1]).any(axis=1))[0])
            return f"{name}: {a.ravel()[item]!r} versus {b.ravel()[item]!r}"
    if len(expected) != len(found):
        return f"{len(expected)} columns versus {len(found)}"
    return ""


def _shape(values: Any) -> str:
    return f"{len(values)} bytes" if isinstance(values, bytes) else f"shape {values.shape}"


class Traces:
    """The states of each compared world alone, after every step: the reference for all stacks."""

    def __init__(self, game: ConformanceGame) -> None:
        self.game = game
        self.steps: dict[int, list[Columns]] = {}
        for seed in SEEDS:
            with game.play([seed]) as sim:
                states = [columns_of(sim, 0)]
                for _ in range(STEPS):
                    sim.step()
                    states.append(columns_of(sim, 0))
            self.steps[seed] = states

    def compare(self, sim: Simulation, world: int, seed: int, step: int, rule: str, where: str) -> None:
        """Compare a world of a stack with the same world alone after `step` steps.

        Raises:
            ConformanceError: They differ.
        """
        difference = first_difference(self.steps[seed][step], columns_of(sim, world))
        if difference:
            name = type(self.game.plugin).__name__
            raise ConformanceError(
                name, rule, f"{where}: after step {step} of the world with seed {seed}, {difference}"
            )
