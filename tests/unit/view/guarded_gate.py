"""A game with births while it is played, a team of nobody at the start, scores that are no whole numbers, and results of its own."""

from __future__ import annotations

import numpy as np

from tussle import Block, Mission
from tussle.api import Autonomy, Interaction, Metric, Output, State
from tussle.stock import SingleIntegrator, Still


class March(Autonomy):
    """Goes west, with a column of its own."""

    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")
    way = State(unit="m", doc="Way so far.")
    goal = State("x y", unit="m")

    def step(self, g):
        self.velocity[:] = 0.0
        self.velocity[0] = -8.0
        self.way[:] += 8.0 * g.dt
        self.goal[0] = 0.25 * g.step_count[g.world]


class Gate(Interaction):
    """Takes out who comes near the gate, one in three of which breaks through and takes a guard with it."""

    stopped = State(dtype=int, per="world")
    passed = State(dtype=int, per="world")

    def step(self, w):
        for row in np.flatnonzero((w.team == 2) & (w.pos[0] < 20.0)):
            world = w.world[row]
            w.kill([row], "at the gate")
            if w.id[row] % 3:
                self.stopped[world] += 1
                continue
            self.passed[world] += 1
            guards = np.flatnonzero((w.team == 1) & (w.world == world))
            w.kill(guards[:1], "overrun")

    def result(self, w):
        return {"stopped": self.stopped, "passed": self.passed}


class Share(Metric):
    """Share of the intruders that were stopped, and points that no whole number holds."""

    def step(self, w):
        pass

    def result(self, w):
        gone = np.zeros(w.n_worlds)
        score = np.zeros((len(w.teams), w.n_worlds))
        score[0] = -0.125 * w.step_count
        score[1] = 0.0005 * np.maximum(w.step_count - 40, 0)
        gone[:] = w.step_count / 100.0
        return {"gone": gone, "score": score}


def guarded_gate(**changes: object) -> Mission:
    """Guards at a gate, and intruders that are born in the course of the game."""
    guards = Block(name="guard", team=1, count=4, variance=(4.0, 4.0, 0.0), motion=Still())
    intruders = Block(
        name="intruder", team=2, count=9, rate=1.2, first_birth=2.0, position=(60.0, 0.0, 0.0), variance=(1.0, 40.0, 0.0),
        autonomy=March(), motion=SingleIntegrator(max_speed=20.0),
    )  # fmt: skip
    return Mission(
        blocks=[guards, intruders], end=20.0, interactions=[Gate()], metrics=[Share()], name="guarded gate"
    ).replace(**changes)
