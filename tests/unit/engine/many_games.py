"""Play many games of some motion models, one model after the other, and print by how much the process has grown in each [MB]."""

from __future__ import annotations

import gc
import os
import sys
from pathlib import Path

from tussle import Block, Mission, Simulation
from tussle.api import Autonomy, Input, MotionModel, Output, Param, State
from tussle.plugins import stock

N_WARM = 40
ROOT = str(stock.examples()["JSBSimModel"].with_name("hawk"))
GIVEN = {
    "JSBSimCompiled": {"aircraft": "hawk", "jsbsim_root": ROOT},
    "JSBSimControl": {"aircraft": "hawk", "jsbsim_root": ROOT},
    "JSBSimModel": {"script_name": "patrol.xml", "jsbsim_root": ROOT},
}
"""Parameters without which a model cannot be played."""


def own_model():
    """A motion model as an author writes it; each call makes the class anew."""

    class Lagging(MotionModel):
        """Along a line, with a first-order lag."""

        lag = Param(0.5, unit="s", gt=0.0)
        x = State("east v", unit="m m/s")
        speed = Input(unit="m/s")

        @staticmethod
        def derivative(v, speed, lag):
            return v, (speed - v) / lag

        def from_body(self, body, rows):
            self.x[:, rows] = 0.0

        def to_body(self, body):
            body.pos[0] = self.x[0]

    return Lagging


def mission(model, **params):
    """A mission of two robots that are told nothing."""
    told = {name: Output(" ".join(c.channels), unit=" ".join(c.units)) for name, c in model.inputs().items()}
    silent = type("Silent", (Autonomy,), {**told, "step": lambda self, g: None, "__doc__": "Say nothing."})
    return Mission(blocks=[Block(name="a", count=2, autonomy=silent(), motion=model(**params))])


def resident():
    """Resident memory of this process [MB]."""
    gc.collect()
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def grown(name, n_games):
    """Growth over n games of a model [MB]."""
    if name == "classes made on the fly":
        games = (mission(own_model()) for _ in range(N_WARM + n_games))
    else:
        model = own_model() if name == "an author's own" else getattr(stock, name)
        games = (game for game in [mission(model, **GIVEN.get(name, {}))] for _ in range(N_WARM + n_games))
    before = 0.0
    for number, game in enumerate(games):
        if number == N_WARM:
            before = resident()
        with Simulation(game) as sim:
            sim.step(2)
    return resident() - before


if __name__ == "__main__":
    for name in sys.argv[2:]:
        n_games = int(sys.argv[1])
        by = grown(name, n_games)
        for _ in range(2):  # an allocator takes a megabyte at some time; what games keep, they keep each time
            by = by if by < 1.0 else min(by, grown(name, n_games))
        print(name, round(by, 3), flush=True)
