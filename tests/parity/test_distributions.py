"""Missions that draw random numbers agree with their recordings in distribution.

A recording is one run of SCRIMMAGE. Its numbers are held against those of 200 seeds at the 1 % level: one number of a run by
its rank among theirs, positions of many by the two-sample Kolmogorov-Smirnov test.
"""

from __future__ import annotations

import numpy as np
import pytest
from recordings import Recording, load, mission

from tussle import Simulation

SEEDS = 200
LEVEL = 0.01
END = 55.0
"""Duration that is compared [s]: of the 31 aircraft of the recording 22 have collided by then, and no more do."""


def rank_p_value(value: float, others: np.ndarray) -> float:
    """Two-sided p-value of one number, by its rank among others of the same distribution."""
    return min(1.0, 2.0 * (1 + min(np.sum(others <= value), np.sum(others >= value))) / (1 + len(others)))


def played() -> tuple[np.ndarray, np.ndarray]:
    """First positions of team 2 [m], (3, m), and the number of entities left in each step, (steps, SEEDS)."""
    game = mission("straight").replace(compat="scrimmage", end=END)
    left: list[np.ndarray] = []

    def look(sim: Simulation) -> None:
        bodies = sim.state.population.bodies
        left.append(np.bincount(bodies.world, minlength=SEEDS))

    with Simulation(game, seeds=list(range(1, SEEDS + 1))) as sim:
        bodies = sim.state.population.bodies
        first = bodies.pos[:, bodies.team == 2].copy()
        sim.observers.append(look)
        sim.run()
    return first, np.array(left)


def recorded_left(recording: Recording, steps: int) -> np.ndarray:
    """The number of entities left in each step of a recording, (steps,)."""
    first = np.zeros(steps + 1)
    for entity, last in recording.last_frame.items():
        birth = recording.frame[recording.id == entity].min()
        first[min(birth, steps)] += 1
        first[min(last + 1, steps)] -= 1
    return np.cumsum(first)[:steps]


@pytest.mark.slow
def test_losses_of_a_recording_are_among_those_of_200_seeds() -> None:
    """Of `straight`: who is left at the end, how long they were there in all, when the first were lost, and where they begin."""
    from scipy.stats import ks_2samp

    recording = load("straight")
    first, left = played()
    wanted = recorded_left(recording, len(left))
    assert left[0].tolist() == [wanted[0]] * SEEDS
    for number in (lambda n: n[-1], lambda n: n.sum(axis=0), lambda n: (n == n[0]).sum(axis=0)):
        assert len(np.unique(number(left))) > 5
        assert rank_p_value(float(number(wanted)), number(left)) >= LEVEL
    there = recording.pos[:, (recording.frame == 0) & (recording.team == 2)]
    is_scattered = np.arange(first.shape[1]) % there.shape[1] > 0
    for axis in range(3):
        assert ks_2samp(there[axis, 1:], first[axis, is_scattered]).pvalue >= LEVEL
