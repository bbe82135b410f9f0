"""A random mission played alone and in stacks with a past: what comes out must be the same."""

from __future__ import annotations

import random
from dataclasses import dataclass
from functools import cache
from typing import Any

import random_missions

from tussle import Mission, Simulation
from tussle.errors import TussleError

LAST = 12
"""Steps that each world plays at most."""

SEEDS = (1, 2, 3)
STACKS = ((1, 2, 3), (2, 3, 1, 1, 3, 2, 2, 1))


@dataclass(frozen=True)
class Alone:
    """What becomes of a world that plays alone: its hash after each step, and the error that ended it."""

    hashes: tuple[str, ...]
    error: str

    def after(self, steps: int) -> str:
        """Hash after some steps; that of its end where it has ended before."""
        return self.hashes[min(steps, len(self.hashes) - 1)]


@cache
def mission(number: int) -> Mission:
    """A random mission that ends after LAST steps."""
    drawn = random_missions.draw(number)
    return drawn.replace(end=LAST * drawn.dt)


def played_alone(number: int, seed: int) -> Alone:
    """Play one world by itself.

    Raises:
        TussleError: The mission cannot be built.
    """
    with Simulation(mission(number), seeds=seed, on_error="record") as sim:
        hashes = [sim.state_hash()]
        while sim.state.running.any():
            sim.step()
            hashes.append(sim.state_hash())
        error = sim.result()[0].error
    return Alone(tuple(hashes), "" if error is None else error.message)


class Stack:
    """Several worlds, and how many steps each should have made with which seed."""

    def __init__(self, number: int, seeds: tuple[int, ...], alone: dict[int, Alone], threads: int) -> None:
        self.sim = Simulation(mission(number), seeds=seeds, threads=threads, on_error="record")
        self.alone = alone
        self.seeds, self.steps = list(seeds), [0] * len(seeds)
        self.saved: Any = None

    def differing(self) -> list[int]:
        """Worlds that are not what they would be alone."""
        expected = [self.alone[s].after(k) for s, k in zip(self.seeds, self.steps, strict=True)]
        return [w for w, e in enumerate(expected) if self.sim.state_hash(w) != e]

    def act(self, chance: random.Random) -> str:
        """Do something that leaves every world what it would be alone; returns what."""
        sim = self.sim
        what = chance.choice(["step", "step", "step", "reset", "snapshot", "restore"])
        if what == "step":
            n = chance.randint(1, 5)
            sim.step(n)
            self.steps = [k + n for k in self.steps]
        elif what == "reset":
            worlds = chance.sample(range(sim.n_worlds), chance.randint(1, sim.n_worlds))
            seeds = [chance.choice(SEEDS) for _ in worlds]
            sim.reset(worlds, seeds=seeds)
            for world, seed in zip(worlds, seeds, strict=True):
                self.seeds[world], self.steps[world] = seed, 0
        elif what == "snapshot":
            self.saved = sim.snapshot(), list(self.seeds), list(self.steps)
        elif self.saved is not None:
            sim.restore(self.saved[0])
            self.seeds, self.steps = list(self.saved[1]), list(self.saved[2])
        return what


def difference(number: int) -> str | None:
    """What is wrong with a random mission; "" for nothing, None where its parts do not fit together."""
    try:
        alone = {seed: played_alone(number, seed) for seed in SEEDS}
    except TussleError:
        return None
    chance = random.Random(number)
    for seeds in STACKS:
        stack = Stack(number, seeds, alone, chance.choice([1, 2]))
        past: list[str] = []
        with stack.sim:
            for turn in range(8):
                past.append(stack.act(chance))
                # What is wrong after another act is still wrong a step later, or at the end.
                if (past[-1] == "step" or turn == 7) and (wrong := stack.differing()):
                    return f"mission {number}, seeds {stack.seeds}, {past}: worlds {wrong} differ after {stack.steps} steps"
    return ""
