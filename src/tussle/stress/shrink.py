"""The smallest failing game: parts of a mission are left out, and numbers rounded, as long as the game still fails."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields
from typing import Any

from tussle.engine.simulation import Simulation
from tussle.errors import ParameterError, TussleError
from tussle.mission import Block, Mission, paths, to_xml
from tussle.stress.changes import absent, is_absence, members, without
from tussle.stress.games import Played
from tussle.stress.monitor import Verdict, Watching

MAX_SHRINK_GAMES = 400
"""Games that a search for a smaller one plays at most."""
DIGITS = 1, 2, 3
"""Significant digits to which numbers are rounded, the fewest first."""


@dataclass(frozen=True)
class SmallestGame:
    """A small game that fails.

    Attributes:
        mission: Its mission, with its luck.
        seed: Its seed.
        robustness: How far it is from breaking the specification, negative.
        n_games: Games that were played to find it.
        is_smallest: Whether no part can be left out; False if the search ended before.
    """

    mission: Mission
    seed: int
    robustness: float
    n_games: int
    is_smallest: bool


def shrink(
    mission: Mission, failed: Played, watching: Watching, max_games: int = MAX_SHRINK_GAMES
) -> SmallestGame:
    """Make a failing game smaller, step by step, until each smaller one passes.

    Args:
        mission: The mission of the game.
        failed: The game.
        watching: The specification.
        max_games: Games to play at most.

    Raises:
        ParameterError: The game does not fail.
    """
    seed = failed.game.seed
    mission = mission.replace(rekeys=failed.game.rekeys)
    verdict, n, tried = play(mission, seed, watching), 1, {to_xml(mission, seed)}
    if verdict is None or not verdict.has_failed:
        raise ParameterError(f"the game with seed {seed} did not fail, so nothing can be shrunk")
    least_step = min(
        1, verdict.first_below(0.0) or 0
    )  # who has failed on the way shall not fail by where it starts
    while True:
        for smaller in _smaller(mission, verdict):
            if smaller is None or (key := to_xml(smaller, seed)) in tried:
                continue
            if n == max_games:
                return SmallestGame(mission, seed, verdict.robustness, n, False)
            tried.add(key)
            found, n = play(smaller, seed, watching), n + 1
            if found is not None and found.has_failed and (found.first_below(0.0) or 0) >= least_step:
                mission, verdict = smaller, found
                break
        else:
            return SmallestGame(mission, seed, verdict.robustness, n, True)


def play(mission: Mission, seed: int, watching: Watching) -> Verdict | None:
    """Play a game; None if it cannot be played, or if the specification is none of this mission."""
    try:
        with Simulation(mission, seed, on_error="raise") as sim:
            monitor = watching(sim)
            sim.run()
            return monitor.finish(0)
    except TussleError:
        return None


def _smaller(mission: Mission, verdict: Verdict) -> Iterator[Mission | None]:
    """Yield smaller missions, those that leave out most first; None for one that is invalid."""
    step = verdict.first_below(0.0)
    if step is not None and (end := mission.start + (step + 1) * mission.dt) < mission.end:
        yield _valid(mission.replace, end=float(f"{end:.12g}"))
    blocks = list(mission.blocks)
    for i, block in enumerate(blocks):
        others = [p for p in mission.interactions if not is_absence(p, block.name)]
        yield _valid(mission.replace, blocks=blocks[:i] + blocks[i + 1 :], interactions=others)
    for i, block in enumerate(blocks):
        gone = absent(mission, block)
        here = sorted(set(range(1, block.count + 1)) - gone)
        if here and here[-1] < block.count:
            yield _valid(_with_block, mission, i, count=here[-1])
        size = len(here) // 2
        while size:
            for k in range(0, len(here), size):
                yield _valid(without, mission, block.name, sorted({*gone, *here[k : k + size]}))
            size //= 2
    for name in ("interactions", "metrics", "networks", "rekeys"):
        for rest in _without_one(getattr(mission, name)):
            if any(is_absence(p) for p in {*getattr(mission, name)} - {*rest}):  # who is left out stays out
                continue
            smaller = _valid(mission.replace, **{name: rest})
            # A mission adds the networks that it cannot be without.
            if smaller is not None and len(getattr(smaller, name)) == len(rest):
                yield smaller
    for i, block in enumerate(blocks):
        for name in ("sensor", "controller", "autonomy"):
            for rest in _without_one(getattr(block, name)):
                yield _valid(_with_block, mission, i, **{name: rest})
    yield from _rounded(mission)


def _without_one(parts: Any) -> Iterator[tuple[Any, ...]]:
    for k in range(len(parts)):
        yield (*parts[:k], *parts[k + 1 :])


def _with_block(mission: Mission, i: int, **values: Any) -> Mission:
    blocks = list(mission.blocks)
    blocks[i] = blocks[i].replace(**values)
    return mission.replace(blocks=blocks)


def _valid(make: Callable[..., Mission], *arguments: Any, **values: Any) -> Mission | None:
    try:
        return make(*arguments, **values)
    except TussleError:
        return None


def _rounded(mission: Mission) -> Iterator[Mission | None]:
    """Yield missions with one value rounded."""
    for path, owner in members(paths.MissionRoot(mission)):
        for name, old in _values(owner):
            for new in _rounder(old):
                yield _valid(paths.with_value, mission, ".".join((*path, name)), new)


def _values(owner: Any) -> Iterator[tuple[str, Any]]:
    """Names and values of the numbers of a block or plugin; those of a mission are its times, which count steps."""
    if isinstance(owner, Block):
        for each in fields(owner):
            if paths.declared(owner, each.name) is not None:
                yield each.name, getattr(owner, each.name)
    elif not isinstance(owner, Mission):
        for name, param in owner.params().items():
            if not param.is_text and not param.structural and owner.values[name] != param.default:
                yield name, owner.values[name]


def _rounder(old: Any) -> Iterator[Any]:
    """Yield rounder values, the roundest first; components are rounded alike, by the largest of them."""
    parts = old if isinstance(old, tuple) else (old,)
    if not all(isinstance(x, float) and math.isfinite(x) for x in parts) or not any(parts):
        return
    first = math.floor(math.log10(max(map(abs, parts))))
    for digits in DIGITS:
        new = tuple(round(x, digits - 1 - first) for x in parts)
        if new != parts:
            yield new if isinstance(old, tuple) else new[0]
