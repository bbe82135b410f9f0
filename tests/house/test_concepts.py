"""Each concept of the interface for authors has one name: what doubled another one does not come back."""

from __future__ import annotations

from tussle import Block, Mission, Simulation
from tussle.api import Autonomy, Interaction, MotionModel
from tussle.stock import Still

GONE = ("caller", "table_bodies", "integrator", "active_outputs")


def test_what_doubled_another_name_is_gone():
    given = [MotionModel, Autonomy]

    class Looker(Autonomy):
        def step(self, g):
            given.append(g)

    class WorldLooker(Interaction):
        def step(self, w):
            given.append(w)

    game = Mission(blocks=[Block(name="a", autonomy=Looker(), motion=Still())], interactions=[WorldLooker()])
    Simulation(game).step()
    assert len(given) == 4
    assert not [(name, thing) for name in GONE for thing in given if hasattr(thing, name)]
