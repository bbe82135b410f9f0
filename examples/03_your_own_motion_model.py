"""Your own motion model, given by its state equation, and a planner that predicts paths with it."""

import numpy as np

from tussle import Block, Mission, Simulation
from tussle.api import Autonomy, Input, MotionModel, Output, Param, State
from tussle.numeric import cos, sin
from tussle.stock import Boids, Predator, SimpleCapture, SimpleCaptureMetrics, Unicycle


class SluggishPlane(MotionModel):
    """A vehicle that flies where its nose points and follows the commanded speed with a first-order lag."""

    lag = Param(2.0, unit="s", gt=0.0, doc="Time constant of the speed.")
    x = State("east north up yaw climb v", unit="m m m rad rad m/s")
    commands = Input("speed turn_rate pitch_rate", unit="m/s rad/s rad/s")

    @staticmethod
    def derivative(yaw, climb, v, speed, turn_rate, pitch_rate, lag):
        level = v * cos(climb)
        return level * cos(yaw), level * sin(yaw), v * sin(climb), turn_rate, pitch_rate, (speed - v) / lag

    def from_body(self, body, rows):
        self.x[:, rows] = np.array([*body.pos, body.yaw, body.climb, body.forward_speed])[:, rows]

    def to_body(self, body):
        body.pos[:] = self.x[:3]
        body.set_attitude(yaw=self.x[3], climb=self.x[4])
        body.vel[:] = self.x[5] * body.forward


PLANE, PREY = SluggishPlane(lag=1.0), Unicycle(vel_max=30)
STEERING = np.meshgrid(38.0, np.linspace(-1.5, 1.5, 7), np.linspace(-1.0, 1.0, 5))
PLANS = np.array(STEERING).reshape(3, 35)  # (3 commands, 35 plans)
SECONDS = 0.3 * np.arange(11)[:, None, None]


class Planner(Autonomy):
    """Predicts 35 steering plans over 3 s with the motion model and takes the one that comes nearest to the prey."""

    commands = Output("speed turn_rate pitch_rate", unit="m/s rad/s rad/s")

    def step(self, g):
        now = np.array([*g.pos, g.yaw, g.climb, np.sqrt(np.square(g.vel).sum(axis=0))])  # (6 states, n)
        path = PLANE.rollout(now.repeat(35, axis=1), np.tile(PLANS, (10, 1, g.n)), dt=0.3)  # (11, 6, n * 35)
        prey = g.nearest(teams=1).other[0]  # (n,) rows of the body table; -1 if no prey is left
        goal = g.bodies.pos[:, prey] + SECONDS * g.bodies.vel[:, prey]  # (11, 3, n)
        miss = path.reshape(11, 6, g.n, 35)[:, :3] - goal[..., None]
        best = np.square(miss).sum(axis=1).min(axis=0).argmin(axis=1)
        self.commands[:, prey >= 0] = PLANS[:, best[prey >= 0]]


# The last writer of a channel wins, so the planner steers; the predator only claims prey within its range.
pack, place, rules = [Predator(), Planner()], (1200, 0, 0), [SimpleCapture()]
prey = Block(name="prey", team=1, count=60, variance=(2e4, 2e4, 0), autonomy=Boids(), motion=PREY)
hunters = Block(name="hunters", team=2, count=5, position=place, heading=np.pi, autonomy=pack, motion=PLANE)
game = Mission(blocks=[prey, hunters], end=60, interactions=rules, metrics=[SimpleCaptureMetrics()])
for r in Simulation(game, seeds=range(1, 5)).run():
    print(f"game {r.seed}: {r.scores[2]:g} captures, {r.alive[1]} prey left after {r.t:g} s")
