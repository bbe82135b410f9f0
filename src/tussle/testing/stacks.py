"""Rules of the conformance kit: a world is the same alone and in every stack, after a reset, and after a restore."""

from __future__ import annotations

from typing import Any

from tussle.columns import Handle
from tussle.engine.simulation import Simulation
from tussle.testing.game import SEEDS, STEPS, Game
from tussle.testing.traces import Traces

STACKS: tuple[tuple[int, int], ...] = ((1, 2), (2, 1), (7, 1), (64, 2))
"""Number of worlds, threads."""


def order_of(n: int) -> list[int]:
    """Seeds of a stack of n worlds: the followed ones in another order, strangers among them."""
    if n == 1:
        return [SEEDS[2]]
    if n == 2:
        return [SEEDS[2], SEEDS[0]]
    seeds = list(range(100, 100 + n))
    places = [(n - 1 - i * (n // len(SEEDS))) % n for i in range(len(SEEDS))]
    for place, seed in zip(places, SEEDS, strict=True):
        seeds[place] = seed
    return seeds


def check_stacks(game: Game, traces: Traces) -> None:
    """World k of a stack is world k alone, bit for bit.

    Raises:
        ConformanceError: It is not.
    """
    most = Handle.most_worlds(game.plugin)
    for n, threads in STACKS:
        if most is not None and n > most:
            continue
        seeds = order_of(n)
        where = f"world alone against the same in a stack of {n}" + (
            f" with {threads} threads" if threads > 1 else ""
        )
        with game.play(seeds, threads) as sim:
            _follow(sim, traces, seeds, range(STEPS + 1), "stack invariance", where)


def check_reset(game: Game, traces: Traces) -> None:
    """Worlds that are reset begin as if new, and the others do not notice.

    Raises:
        ConformanceError: They do not, or do.
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
                    "fresh start against reset"
                    if world
                    else "world alone against one whose neighbours were reset"
                )
                traces.hold(sim, world, seeds[world], age, "reset", where)
            sim.step()
            ages = [age + 1 for age in ages]
    with game.play([SEEDS[0]]) as sim:
        sim.step(6)
        sim.reset([0])
        _follow(sim, traces, [SEEDS[0]], range(8), "reset", "fresh start against a reset of all worlds")


def check_snapshot(game: Game, traces: Traces) -> None:
    """After a restore the same future follows, in the same simulation and in another.

    Raises:
        ConformanceError: Another one does.
    """
    cls = type(game.plugin)
    if cls.handles() and not hasattr(cls, "save_one"):
        return  # it holds objects outside the arrays and refuses, which is allowed
    n = min(3, Handle.most_worlds(cls) or 3)
    seeds = list(SEEDS[:n])
    with game.play(seeds) as sim:
        sim.step(7)
        saved: Any = sim.snapshot()
        _follow(
            sim,
            traces,
            seeds,
            range(7, STEPS + 1),
            "snapshot",
            "world alone against one of which a snapshot was taken",
        )
        sim.restore(saved)
        _follow(sim, traces, seeds, range(7, STEPS + 1), "snapshot", "before against after restore")
    with game.play(seeds) as other:
        other.step(2)
        other.restore(saved)
        _follow(
            other,
            traces,
            seeds,
            range(7, STEPS + 1),
            "snapshot",
            "before against after restore into another simulation",
        )


def _follow(sim: Simulation, traces: Traces, seeds: list[int], steps: range, rule: str, where: str) -> None:
    followed = [(world, seed) for world, seed in enumerate(seeds) if seed in traces.steps]
    for step in steps:
        for world, seed in followed:
            traces.hold(sim, world, seed, step, rule, where)
        sim.step()
