"""A game whose result is a bowl with a known greatest value, and which costs next to nothing; this file is a plugin file too."""

from __future__ import annotations

import numpy as np

from tussle import Block, Mission
from tussle.api import Metric, Param
from tussle.stock import Still

BEST_X, BEST_Y, TOP = 3.0, -1.0, 10.0


class Bowl(Metric):
    """A height that is greatest at x = 3, y = -1, with luck that depends on the seed alone."""

    grade = "portable"

    x = Param(0.0, ge=-100.0, le=100.0)
    y = Param(-1.0)
    luck = Param(0.0)
    fails_from = Param(1000.0)
    rough = Param(0.0)

    def step(self, w):
        if (self.x >= self.fails_from).any():
            raise RuntimeError("too far out")

    def result(self, w):
        height = TOP - (self.x - BEST_X) ** 2 - (self.y - BEST_Y) ** 2
        own = mixed = 0.0
        if self.luck.any() or self.rough.any():
            own = (w.seeds * np.uint64(7919) % np.uint64(11)).astype(float) / 10.0 - 0.5
            # The usual noise of shaders: neighbours in x have nothing to do with each other.
            mixed = np.mod(np.sin(12.9898 * w.seeds.astype(float) + 78233.0 * self.x) * 43758.5453, 1.0) - 0.5
        return {
            "height": height + self.luck * own + self.rough * mixed,
            "log": np.where(self.x < 0.0, np.nan, self.x),
        }


MISSION = """\
<?xml version="1.0"?>
<runscript name="A bowl">
  <run start="0" end="0.3" dt="0.1"/>
  <metrics x="${x=0}" y="${y=-1}" luck="${luck=0}" fails_from="${fails_from=1000}" rough="${rough=0}">Bowl</metrics>
  <entity>
    <name>ball</name> <team_id>1</team_id> <count>${n=1}</count>
    <motion_model>Still</motion_model>
  </entity>
</runscript>
"""


def mission(x=0.0, y=-1.0, n=1, **more):
    """The game, made in Python."""
    return Mission(
        blocks=[Block(name="ball", team=1, count=n, motion=Still())],
        dt=0.1,
        end=0.3,
        metrics=[Bowl(x=x, y=y, **more)],
    )
