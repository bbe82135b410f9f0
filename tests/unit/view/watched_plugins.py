"""Plugins for the tests of games that are watched."""

from __future__ import annotations

from tussle import Block, Mission
from tussle.api import Autonomy, Interaction, Output, State, Subscribe
from tussle.messages import CustomKeyPress, WorldPointClicked
from tussle.stock import SingleIntegrator


class GoWhereClicked(Autonomy):
    """Stay, or fly to the last place that somebody pointed at; draw where that is."""

    goal = State("x y z", unit="m")
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")
    clicked = Subscribe(WorldPointClicked)

    def spawn(self, g, rows):
        self.goal[:, rows] = g.pos[:, rows]

    def step(self, g):
        rows, heard = self.clicked.latest()
        self.goal[:, rows] = heard.pos
        self.velocity[:] = self.goal - g.pos
        g.draw.vectors(pos=g.pos, direction=self.goal - g.pos, world=g.world, colour=(255, 0, 0))
        g.draw.text(pos=self.goal[:, 0], text="goal", lifetime=0.35)


class CountsSteps(Interaction):
    """Counts its calls outside the declared columns as well: a call more or less shows."""

    calls = State(dtype=int, per="world")
    keys = State(dtype=int, per="world")

    def step(self, w):
        self.calls[w.world[0] if w.n else 0] += 1
        for world, key in zip(w.inbox(CustomKeyPress).world, w.inbox(CustomKeyPress).key, strict=True):
            self.keys[world] += ord(key)


class Fails(Autonomy):
    """Fails at a time."""

    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    def step(self, g):
        if g.t[0] > 0.95:
            raise ValueError("it is late")
        self.velocity[:] = 1.0


def clickable(**changes: object) -> Mission:
    """Drones that go where one points."""
    drone = Block(
        name="drone", team=1, count=3, variance=(100, 100, 100), autonomy=GoWhereClicked(), motion=SingleIntegrator(max_speed=20.0),
    )  # fmt: skip
    return Mission(blocks=[drone], interactions=[CountsSteps()], end=8.0, name="clickable").replace(**changes)


def failing() -> Mission:
    """A game that breaks in its tenth step."""
    return Mission(
        blocks=[Block(name="late", team=1, count=2, autonomy=Fails(), motion=SingleIntegrator())], end=3.0
    )


class KillsAndMoves(Interaction):
    """Takes one out and puts another elsewhere, at a time."""

    def step(self, w):
        if 0.55 < w.t[0] < 0.65:
            w.kill([0], "fate")
            w.move([1], pos=w.pos[:, [1]] + 5.0)


class FailsOnce(Interaction):
    """Fails in the step of KillsAndMoves, as long as nobody says a key."""

    def step(self, w):
        if 0.55 < w.t[0] < 0.65 and not len(w.inbox(CustomKeyPress)):
            raise ValueError("nobody spoke")
