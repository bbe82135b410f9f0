"""The paper's game flies as the paper's code flew it, step by step.

The recording of one game has the states after some steps, and velocities that are the means over the last step of 0.1 s. So
the starts are the first places less 0.1 s of the first velocities; headings are the mission's, prey East and predators West.
"""

from __future__ import annotations

import csv
import gzip

import numpy as np
from recordings import folder

from tussle import Simulation
from tussle.mission import read_mission
from tussle.record import FirstStates

NAME = "paper2017_seed1_trajectory.csv.gz"
DT = 0.1
EXACT = 201
"""Steps after which places agree to rounding; the flock then multiplies differences of the last bits, by about e in 2 s."""
LIMIT = 1e-9  # [m]
LATE_LIMIT = 1e-3  # [m]


def frames() -> dict[int, dict[int, np.ndarray]]:
    """Number of steps -> id -> position and velocity, (6,)."""
    place = folder()
    assert place is not None
    found: dict[int, dict[int, np.ndarray]] = {}
    with gzip.open(place / "truth" / NAME, "rt") as file:
        for row in csv.DictReader(file):
            values = np.array([float(row[name]) for name in ("x", "y", "z", "vx", "vy", "vz")])
            found.setdefault(round(float(row["frame_time"]) / DT) + 1, {})[int(row["id"])] = values
    return found


def test_the_first_minute_is_that_of_the_papers_code():
    recorded = frames()
    mission = read_mission("predator_prey_paper").mission
    team = np.repeat([1, 2, 3], [100, 5, 5])
    first = np.array([recorded[1][id_] for id_ in range(1, 111)]).T
    quat = np.where(team == 1, [[1.0], [0.0], [0.0], [0.0]], [[0.0], [0.0], [0.0], [1.0]])
    starts = FirstStates(
        np.zeros(110), np.arange(1, 111), first[:3] - DT * first[3:], quat, np.zeros((3, 110)), team
    )
    assert (
        np.abs(starts.pos[:, [0, 100, 105]] - [[0, 2000, 2000], [0, -1000, 1000], [200, 200, 200]]).max()
        < 1e-12
    )
    with Simulation(mission, start_from=starts) as sim:
        for steps, states in sorted(recorded.items()):
            sim.step(steps - int(sim.steps[0]))
            bodies = sim.state.population.bodies
            order = np.argsort(bodies.id)
            assert bodies.id[order].tolist() == sorted(states)
            expected = np.array([states[id_][:3] for id_ in sorted(states)]).T
            distance = np.sqrt(((bodies.pos[:, order] - expected) ** 2).sum(axis=0))
            assert distance.max() < (LIMIT if steps <= EXACT else LATE_LIMIT), f"after step {steps}"
    assert max(recorded) == 601
