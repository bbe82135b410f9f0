"""What fails in a game, and who: signals beyond their bounds at the moment of the failure, and the entities that they are due to."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np

from tussle.api.bodies import Bodies
from tussle.engine.simulation import Simulation
from tussle.errors import ParameterError
from tussle.mission import Mission
from tussle.stress.games import Played
from tussle.stress.monitor import Monitor
from tussle.stress.signals import ChosenRows, Signal, StepView
from tussle.stress.specification import Specification

MAX_BLAMED = 300
"""Living entities of a game up to which those are looked for that a failure is due to."""


@dataclass
class _Alone:
    """A moment of a game, of which only the body table and the time are known."""

    t: np.ndarray

    def read(self, path: str) -> tuple[np.ndarray, np.ndarray]:
        raise ParameterError(f"{path} is not known without an entity")


def blame(mission: Mission, failed: Played, specification: Specification) -> tuple[str, ...]:
    """Signals below or above their bounds when a game fails, each with the entities without which it would have another value.

    Such as ("distance(all, all) of east/3, north/7",). The game is played again up to there.

    Args:
        mission: The mission of the game.
        failed: A game that failed.
        specification: What it broke.
    """
    step = failed.verdict.first_below(0.0) or 0
    with Simulation(mission.replace(rekeys=failed.game.rekeys), failed.game.seed) as sim:
        monitor = Monitor(specification, sim)
        sim.step(step)
        traces = monitor.trace(0)
        parked = sim.state.parked.get(0)
        bodies = sim.state.population.bodies if parked is None else parked.bodies
        without = _without_each(bodies, float(sim.t[0])) if bodies.n <= MAX_BLAMED else None
        others = {
            name: None if without is None else _value(s, without) for name, s in specification.signals.items()
        }
    is_broken = dict.fromkeys(traces, False)
    for term in specification.terms.values():
        own = [str(part.signal) for part in term.parts() if hasattr(part, "signal")]
        if not term.is_late:
            is_low = bool(term.values(traces)[-1] < 0.0)
            is_broken.update(dict.fromkeys(own, True) if is_low else {})
    found = []
    for name in (name for name, is_so in is_broken.items() if is_so):
        other = others[name]
        mine = np.zeros(0, int) if other is None else np.flatnonzero(other != traces[name][-1])
        who = [f"{mission.blocks[bodies.block[i]].name}/{bodies.block_index[i] + 1}" for i in mine]
        found.append(f"{name} of {', '.join(who)}" if 0 < len(who) < bodies.n else name)
    return tuple(found)


def _without_each(bodies: Bodies, t: float) -> StepView:
    """As many worlds as entities: in each, one of them is missing."""
    world, row = np.nonzero(~np.eye(bodies.n, dtype=bool))
    many = Bodies(bodies.floats.take(row, axis=1), bodies.ints.take(row, axis=1), bodies.n)
    many.world[:] = world
    start = np.arange(bodies.n + 1) * max(bodies.n - 1, 0)
    return StepView(_Alone(np.full(bodies.n, t)), many, ChosenRows(many, (np.arange(many.n), start)))


def _value(signal: Signal, view: StepView) -> Any:
    """Values of a signal; None where they are not known."""
    with suppress(ParameterError, AssertionError):
        return signal.evaluate(view)
    return None
