"""A parameter sweep in one stack: each world has its own parameter value, and all worlds are stepped together."""

import numpy as np

from tussle import Block, Mission, Simulation
from tussle.stock import Boids, Predator, SimpleCapture, SimpleCaptureMetrics, Unicycle

prey = Block(
    name="prey",
    team=1,
    count=50,
    variance=(2e4, 2e4, 0),
    autonomy=Boids(),
    motion=Unicycle(vel_max=30),
)
hunters = Block(
    name="hunters",
    team=2,
    count=5,
    position=(1000, 0, 0),
    variance=(1e5, 1e5, 0),
    heading="180 deg",
    autonomy=Predator(max_speed=35),
    motion=Unicycle(vel_max=35, pitch_rate_max=1.5),
)
mission = Mission(
    blocks=[prey, hunters],
    end=120,
    interactions=[SimpleCapture()],
    metrics=[SimpleCaptureMetrics()],
)
turn_rates = [0.2, 0.4, 0.8, 1.6, 3.2]  # [rad/s]
seeds = range(1, 17)
worlds = [(rate, seed) for rate in turn_rates for seed in seeds]
results = Simulation(
    mission,
    seeds=[seed for _, seed in worlds],
    params={"hunters.Unicycle.turn_rate_max": [rate for rate, _ in worlds]},
).run()
captures = np.array([r.scores[2] for r in results]).reshape(len(turn_rates), len(seeds))
for rate, row in zip(turn_rates, captures, strict=True):
    mean, error = row.mean(), row.std(ddof=1) / np.sqrt(len(row))
    print(f"{rate} rad/s: {mean:4.1f} +- {error:.1f} captures  {'#' * round(mean)}")
