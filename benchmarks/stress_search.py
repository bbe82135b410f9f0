"""Games until a search finds a planted failure: ten missions in which less than one random game of 10,000 fails.

Two robots fly at constant velocity in gusts, past a third one that stands still. A game fails if both come near to it. Where it stands, and
with which velocities, six numbers that are varied, that happens, is drawn from the number of the mission.

    python benchmarks/stress_search.py --repetitions 20
"""

from __future__ import annotations

import argparse

import numpy as np

from tussle import Block, Mission
from tussle.api import Autonomy, Output, Param
from tussle.stock import SingleIntegrator
from tussle.stress import Stress

MAX_GAMES = 2000
MAX_SPEED, LENGTH, DT = 20.0, 20.0, 0.1
MAX_PROBABILITY, N_DRAWN = 1e-4, 400_000


class Drift(Autonomy):
    """Flies at a constant velocity, while gusts push it about."""

    grade = "portable"
    vx = Param(0.0, unit="m/s", doc="Velocity east.")
    vy = Param(0.0, unit="m/s", doc="Velocity north.")
    vz = Param(0.0, unit="m/s", doc="Velocity up.")
    gust = Param(0.3, unit="m/s", ge=0.0, doc="Standard deviation of the wind's speed, drawn in each step.")
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    def step(self, g):
        self.velocity[:] = (self.vx, self.vy, self.vz) + self.gust * g.normal("gust", 3)


STARTS = {"left": (-100.0, 0.0, 100.0), "right": (0.0, -100.0, 100.0)}
VARY = {f"{name}.Drift.{axis}": (-MAX_SPEED, MAX_SPEED) for name in STARTS for axis in ("vx", "vy", "vz")}


def planted(number: int) -> tuple[Mission, str, float]:
    """A mission, what must hold, and the share of games with random values that fail."""
    rng = np.random.default_rng(number)
    place = rng.uniform((-60.0, -60.0, 60.0), (60.0, 60.0, 140.0)).round(1)
    velocities = rng.uniform(-MAX_SPEED, MAX_SPEED, (2, N_DRAWN, 3))
    distances = [least(np.array(s), v, place) for s, v in zip(STARTS.values(), velocities, strict=True)]
    worst = np.sort(np.maximum(*distances))
    radius = float(np.floor(10.0 * worst[int(MAX_PROBABILITY * N_DRAWN / 2)]) / 10.0)
    blocks = [
        Block(name=name, team=1, position=start, autonomy=Drift(), motion=SingleIntegrator())
        for name, start in STARTS.items()
    ]
    blocks.append(
        Block(
            name="post",
            team=2,
            position=tuple(place.tolist()),
            autonomy=Drift(gust=0.0),
            motion=SingleIntegrator(),
        )
    )
    text = f"always (distance(left, post) > {radius}) or always (distance(right, post) > {radius})"
    return Mission(blocks=blocks, end=LENGTH, dt=DT), text, float(np.mean(worst < radius))


def least(start: np.ndarray, velocities: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Least distance of robots without gusts from a place, (n,)."""
    to = place - start
    square = np.maximum((velocities**2).sum(axis=1), 1e-9)
    t = np.clip(velocities @ to / square, 0.0, LENGTH)
    return np.sqrt(((t[:, None] * velocities - to) ** 2).sum(axis=1))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--repetitions", type=int, default=20)
    parser.add_argument("--samplers", nargs="*", default=["cmaes", "tpe", "random"])
    given = parser.parse_args()
    print(
        f"games until the first failure, median of {given.repetitions}; found of {given.repetitions} in {MAX_GAMES:,} games"
    )
    for number in range(10):
        mission, text, share = planted(number)
        row = [f"mission {number}: random games fail with {share:.1e}"]
        for sampler in given.samplers:
            found = []
            for repetition in range(given.repetitions):
                study = Stress(mission, text, vary=VARY, first_seed=1_000_000 * repetition)
                search = study.search(MAX_GAMES, sampler, sample_seed=repetition, failures=1, processes=1)
                found.append(search.first or MAX_GAMES + 1)
            n = sum(first <= MAX_GAMES for first in found)
            row.append(f"{sampler} {np.median(found):,.0f}, {n} of {len(found)}")
        print("; ".join(row), flush=True)


if __name__ == "__main__":
    main()
