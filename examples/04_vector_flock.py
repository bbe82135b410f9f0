"""A flock in vectorised NumPy: one call steers all robots of all worlds, with constant Python overhead."""

import time

import numpy as np

from tussle import Block, Mission, Simulation
from tussle.api import Autonomy, GroupView, Output, Param, unit
from tussle.stock import SingleIntegrator


class Flock(Autonomy):
    """Separation, alignment and cohesion."""

    sight = Param(60.0, unit="m", gt=0.0)
    space = Param(20.0, unit="m", gt=0.0, doc="Distance below which team mates repel.")
    max_speed = Param(15.0, unit="m/s", ge=0.0)
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    def step(self, g: GroupView) -> None:
        near = g.near(self.sight, teams="own")  # pairs of a robot and a neighbour
        push = np.maximum(0.0, 1.0 - near.distance / self.space[near.row]) / near.distance
        separation = near.sum(-push * near.offset)  # (3, n), like all vectors
        alignment = unit(near.mean(near.vel))
        cohesion = unit(near.mean(near.offset))
        self.velocity[:] = self.max_speed * unit(separation + 2.0 * alignment + 0.1 * cohesion)


def order(simulation: Simulation) -> float:
    """Order parameter of the velocities, from 0 to 1 for equal velocities (Vicsek 1995, equation 5)."""
    velocity, _ = simulation.read("flock.vel")  # (worlds, robots, 3)
    return float(np.linalg.norm(velocity.mean(axis=1)) / 15.0)


flock = Block(
    name="flock",
    count=1000,
    variance=(4e4, 4e4, 0),
    scatter_first=True,
    autonomy=Flock(),
    motion=SingleIntegrator(),
)
simulation = Simulation(Mission(blocks=[flock], end=40), seeds=1)
simulation.step()
began = time.process_time()
for seconds in (0, 10, 20, 30, 40):
    simulation.run(until=seconds)
    print(f"after {seconds:2} s the flock's order is {order(simulation):.2f}")
print(f"{time.process_time() - began:.1f} CPU s for {simulation.steps[0]} steps of 1000 robots")
