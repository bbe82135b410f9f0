"""An autonomy on a real robot: states come from the robot, commands go to the robot.

`Robot` takes the place of a robot's driver: it accepts speed and turn rate and reports its position and yaw.
"""

import math

import numpy as np

from tussle import Block, Mission, Simulation
from tussle.stock import Boids, External

DT = 0.05  # [s]


class Robot:
    """An ideal wheeled robot."""

    def __init__(self, east: float, north: float) -> None:
        self.pos, self.yaw, self.speed = np.array([east, north, 0.0]), 0.0, 0.0

    def drive(self, speed: float, turn_rate: float) -> None:
        self.speed, self.yaw = speed, self.yaw + DT * turn_rate
        self.pos[:2] += DT * speed * np.array([math.cos(self.yaw), math.sin(self.yaw)])


def states(robots: list[Robot]) -> dict[str, np.ndarray]:
    """Current states of the robots, (1 world, n robots, components)."""
    yaw = np.array([r.yaw for r in robots])
    level, speed = 0.0 * yaw, np.array([r.speed for r in robots])
    return {
        "pos": np.array([[r.pos for r in robots]]),
        "vel": np.array([speed * [np.cos(yaw), np.sin(yaw), level]]).transpose(0, 2, 1),
        "quat": np.array([[np.cos(yaw / 2), level, level, np.sin(yaw / 2)]]).transpose(0, 2, 1),
    }


robots = [Robot(east, north) for east, north in [(0, 0), (30, 5), (10, -30), (-25, 20)]]
block = Block(name="robot", team=1, count=4, autonomy=Boids(max_speed=2.0), motion=External())
simulation = Simulation(Mission(blocks=[block], dt=DT, end=3600.0))
for _ in range(400):
    for column, values in states(robots).items():
        simulation.write(f"robot.{column}", values)
    simulation.step()
    (speed,), (turn_rate,) = (simulation.read(f"robot.Boids.{name}")[0] for name in ("speed", "turn_rate"))
    for robot, *command in zip(robots, speed, turn_rate, strict=True):
        robot.drive(*command)
for number, robot in enumerate(robots, 1):
    print(f"robot {number} is at {robot.pos[0]:6.1f} m east, {robot.pos[1]:6.1f} m north")
