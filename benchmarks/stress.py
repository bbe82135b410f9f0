"""The cost of robustness: CPU time of steps with a monitor beside the same steps without, in turn; medians."""

import time

import numpy as np

from tussle import Simulation
from tussle.mission import read_mission
from tussle.stress import Monitor, Specification

TEXT = "always (distance(team 1, team 1) > 2 m)"
BOTH = TEXT + " and always (distance(team 1, team 2) > 2 m -> eventually[0,5] (max_speed(all) < 60))"
STEPS, ROUNDS = 150, 7


def cost(mission, n_worlds, text):
    """CPU time of a step [us] without and with a monitor."""
    times = {False: [], True: []}
    for _ in range(ROUNDS):
        for is_monitored in (False, True):
            sim = Simulation(mission, range(1, n_worlds + 1))
            if is_monitored:
                Monitor(Specification.parse(text, mission), sim)
            sim.step(5)
            began = time.process_time()
            sim.step(STEPS)
            times[is_monitored].append((time.process_time() - began) / STEPS * 1e6)
            sim.close()
    return np.median(times[False]), np.median(times[True])


def main():
    mission = read_mission("predator_prey", {"prey": 97, "run.end": 60}).mission
    print(
        f"{sum(b.count for b in mission.blocks)} entities; CPU time of a step without a monitor, and what it adds"
    )
    for n_worlds in (1, 8, 80):
        for text in (TEXT, BOTH):
            plain, monitored = cost(mission, n_worlds, text)
            print(f"{n_worlds:3} worlds  {plain:8.1f} us  + {100 * (monitored / plain - 1):5.1f} %  {text}")


if __name__ == "__main__":
    main()
