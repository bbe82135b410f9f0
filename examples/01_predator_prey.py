"""The game of DeMarco, Squires, Day and Pippin (2018): two teams of five predators hunt a flock of 100 prey for 500 s.

Team 2 follows one prey until it is captured; team 3 follows the nearest prey in every step.
"""

import argparse
import time

from tussle import Block, Mission, Simulation
from tussle.stock import Boids, Predator, SimpleCapture, SimpleCaptureMetrics, Unicycle

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("--seeds", type=int, default=8, help="number of games, all played in one stack")
parser.add_argument("--end", type=float, default=500.0, help="duration of a game [s]")
args = parser.parse_args()

prey = Block(
    name="prey",
    team=1,
    count=100,
    position=(0, 0, 200),
    placement="uniform",
    half_width=(200, 200, 100),
    autonomy=Boids(),
    motion=Unicycle(vel_max=30),
)


def hunters(name: str, team: int, north: float, switching: bool) -> Block:
    """Five predators 2 km East of the prey, flying West."""
    predator = Predator(max_speed=35, allow_prey_switching=switching)
    motion = Unicycle(vel_max=35, turn_rate_max=2, pitch_rate_max=1.5)
    far = prey.replace(name=name, team=team, count=5, position=(2000, north, 200), half_width=(500, 500, 100))
    return far.replace(heading="180 deg", autonomy=predator, motion=motion)


mission = Mission(
    blocks=[prey, hunters("keepers", 2, -1000, False), hunters("switchers", 3, +1000, True)],
    end=args.end,
    end_conditions="time, one_team, all_dead",
    interactions=[SimpleCapture()],
    metrics=[SimpleCaptureMetrics()],
)
simulation = Simulation(mission, seeds=range(1, args.seeds + 1))
simulation.step()  # the first step loads the kernels, or compiles them if they are not cached
began = time.process_time()
results = simulation.run()
cpu = time.process_time() - began

print("seed  prey left  captured by 2  by 3  winner  end        s  state hash")
for r in results:
    winner = f"team {r.winner}" if r.winner else "tie"
    print(f"{r.seed:4} {r.alive[1]:10} {r.scores[2]:14g} {r.scores[3]:5g}  {winner:7}", end=" ")
    print(f"{r.end:8} {r.t:3g}  {r.state_hash[:20]}")
won = {team: sum(r.winner == team for r in results) for team in (2, 3, None)}
print(f"team 2 won {won[2]}, team 3 won {won[3]}, {won[None]} ties")
print(f"{sum(r.t for r in results):g} s of game in {cpu:.2f} CPU s: {cpu / len(results):.2f} CPU s a game")
