"""Rules of the conformance kit: a world is bit-identical alone and in every stack, after a reset, and after a restore."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from tussle.declare.columns import Handle
from tussle.engine.calls import Call
from tussle.engine.joined_calls import JoinedCalls
from tussle.engine.simulation import Simulation
from tussle.engine.snapshot import hashed
from tussle.engine.state import SimulationState
from tussle.errors import ConformanceError, PluginError
from tussle.testing.game import SEEDS, STEPS, ConformanceGame

STACKS: tuple[tuple[int, int], ...] = ((1, 2), (2, 1), (7, 1), (64, 2))
"""Number of worlds, threads."""
NEVER = 10**9
"""Number of steps after which nothing is joined."""


def order_of(n: int) -> list[int]:
    """Seeds of a stack of n worlds: the compared ones in another order, with other seeds between them."""
    if n == 1:
        return [SEEDS[2]]
    if n == 2:
        return [SEEDS[2], SEEDS[0]]
    seeds = list(range(100, 100 + n))
    places = [(n - 1 - i * (n // len(SEEDS))) % n for i in range(len(SEEDS))]
    for place, seed in zip(places, SEEDS, strict=True):
        seeds[place] = seed
    return seeds


def check_stacks(game: ConformanceGame, traces: Traces) -> None:
    """World k of a stack is bit-identical to world k alone.

    Raises:
        ConformanceError: It is not.
    """
    most = Handle.most_worlds(game.plugin)
    for n, threads in STACKS:
        if most is not None and n > most:
            continue
        seeds = order_of(n)
        where = f"world alone versus in a stack of {n}" + (f" with {threads} threads" if threads > 1 else "")
        with game.play(seeds, threads) as sim:
            _follow(sim, traces, seeds, range(STEPS + 1), "stack invariance", where)


def check_reset(game: ConformanceGame, traces: Traces) -> None:
    """Reset worlds equal new ones, and the other worlds do not change.

    Raises:
        ConformanceError: A reset world differs, or another world changes.
    """
    most = Handle.most_worlds(game.plugin)
    if most is not None and most < 4:
        return
    seeds = list(SEEDS[:4])
    with game.play(seeds) as sim:
        sim.step(14)
        sim.reset([3, 1, 2])  # world 2 has ended by now
        ages = [14, 0, 0, 0]
        for _ in range(STEPS - 14 + 1):
            for world, age in enumerate(ages):
                where = (
                    "new world versus reset world"
                    if world
                    else "world alone versus in a stack whose other worlds were reset"
                )
                traces.compare(sim, world, seeds[world], age, "reset", where)
            sim.step()
            ages = [age + 1 for age in ages]
    with game.play([SEEDS[0]]) as sim:
        sim.step(6)
        sim.reset([0])
        _follow(sim, traces, [SEEDS[0]], range(8), "reset", "new world versus a reset of all worlds")


def check_snapshot(game: ConformanceGame, traces: Traces) -> None:
    """The same future follows after a restore, in the same simulation and in another.

    Raises:
        ConformanceError: The future differs.
    """
    cls = type(game.plugin)
    if cls.handles() and not hasattr(cls, "save_one"):
        return  # it has handles and refuses snapshots, which is allowed
    n = min(3, Handle.most_worlds(cls) or 3)
    seeds = list(SEEDS[:n])
    with game.play(seeds) as sim:
        sim.step(7)
        saved: Any = sim.snapshot()
        steps = range(7, STEPS + 1)
        _follow(sim, traces, seeds, steps, "snapshot", "world alone versus after taking a snapshot")
        sim.restore(saved)
        _follow(sim, traces, seeds, steps, "snapshot", "before versus after restore")
    with game.play(seeds) as other:
        other.step(2)
        other.restore(saved)
        where = "before versus after restore into another simulation"
        _follow(other, traces, seeds, steps, "snapshot", where)


def check_kernels(game: ConformanceGame) -> None:
    """The kernels of a plugin that `only_calls_kernels` give the same bits where they are called without it.

    Raises:
        ConformanceError: They do not.
    """
    cls = type(game.plugin)
    if not vars(cls).get("only_calls_kernels"):
        return
    seeds = [SEEDS[0]]
    with Simulation(game.quiet, seeds) as sim, Simulation(game.quiet, seeds) as other:
        for each, steady in ((sim, 1), (other, NEVER)):
            each.state.context.steady_steps = steady, steady
            each.schedule.join = partial(_each_joined, each.state)
        for step in range(STEPS):
            other.step()
            try:
                sim.step()
            except PluginError as error:
                raise ConformanceError(cls.__name__, "only_calls_kernels", str(error)) from error
            if difference := first_difference(columns_of(other, 0), columns_of(sim, 0)):
                text = (
                    f"its step versus the kernels that it calls, alone: after step {step + 1}, {difference}"
                )
                raise ConformanceError(cls.__name__, "only_calls_kernels", text)


def _each_joined(state: SimulationState, calls: list[Call]) -> list[Callable[[], None]]:
    return [JoinedCalls(state, [call]).run if call.views else call.run for call in calls]


def _follow(sim: Simulation, traces: Traces, seeds: list[int], steps: range, rule: str, where: str) -> None:
    followed = [(world, seed) for world, seed in enumerate(seeds) if seed in traces.steps]
    for step in steps:
        for world, seed in followed:
            traces.compare(sim, world, seed, step, rule, where)
        sim.step()


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
