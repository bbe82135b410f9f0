"""A car that plans with its own motion model, sees walls only from near, and plans again while it drives."""

import math
from types import SimpleNamespace
from typing import Any

import numpy as np

from tussle import Block, Mission, Simulation
from tussle.api import Autonomy, GroupView, Handle, Output, Param
from tussle.plan import Problem, solve
from tussle.scene import Cuboid, Scene
from tussle.stock import Unicycle

WALLS = [
    Cuboid(center=(x, y, 0), lengths=(10, length, 20))
    for x, y, length in [(40, 40, 80), (40, 95, 10), (70, 5, 10), (70, 60, 80)]
]
GOAL = (92.0, 12.0, 0.0)
CAR = Unicycle(vel_max=5.0, turn_rate_max=1.0, use_pitch=False)


class PlanAndDrive(Autonomy):
    """Follows the fastest plan around the walls it has seen; plans again when it sees more, or the plan is over."""

    sight = Param(25.0, unit="m")
    command = Output("speed turn_rate velocity_z", unit="m/s rad/s m/s")
    mind = Handle(doc="The plan, the next step in it, and how many walls it knows.")

    def open_one(self, row: int) -> SimpleNamespace:
        return SimpleNamespace(plan=None, at=0, n_known=-1)

    def step(self, g: GroupView) -> None:
        for row, mind in enumerate(self.mind):
            pos = g.pos[:, row]
            walls = [wall for wall in WALLS if wall.center[0] - pos[0] < self.sight[row]]
            if len(walls) > mind.n_known or mind.at == len(mind.plan.inputs):
                start = {"x": pos[0], "y": pos[1], "yaw": g.yaw[row]}
                mind.plan, mind.at, mind.n_known = solve(problem(start, walls), seed=1), 0, len(walls)
                print(f"{g.t[row]:4.1f} s: {len(walls)} walls are known, {mind.plan.cost:.1f} s to go")
            g.draw.cloud(pos=mind.plan.nodes, value=mind.plan.costs, size=0.3)
            self.command[:, row] = mind.plan.inputs[mind.at]
            mind.at += 1


def problem(start: dict[str, Any], walls: list[Cuboid]) -> Problem:
    """The way from a state to the goal around some walls."""
    commands = {"speed": (2.0, 5.0), "turn_rate": (-1.0, 1.0)}
    bounds = {"x": (0, 100), "y": (0, 100), "yaw": (-math.tau, math.tau)}
    return Problem(CAR, start, GOAL, 4.0, bounds, commands, scene=Scene(walls=walls), radius=1.0, longest=20)


block = Block(name="car", team=1, position=(8, 12, 0), autonomy=PlanAndDrive(), motion=CAR)
simulation = Simulation(Mission(blocks=[block], scene=Scene(walls=WALLS), dt=0.1, end=90.0))
pos = np.zeros(3)
while not simulation.is_over and math.dist(pos, GOAL) > 4.0:
    simulation.step()
    pos = simulation.read("car.pos")[0][0, 0]
print(f"the car is {math.dist(pos, GOAL):.1f} m from its goal after {simulation.t[0]:.1f} s")
