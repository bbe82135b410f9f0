"""A world that begins anew in the places of its rows: what follows from ids lives on, what follows from seeds and parameters does not."""

from __future__ import annotations

import numpy as np
import pytest
from small_worlds import VELOCITY, Wander, alone, block, mission

from tussle import Simulation
from tussle.api import Autonomy, Interaction, Output, Param
from tussle.stock import Boids, Unicycle


class Look(Autonomy):
    """Fly as fast as there are neighbours within a radius."""

    grade = "portable"
    radius = Param(0.5, unit="m", ge=0.0)
    velocity = Output(VELOCITY, unit="m/s")

    def step(self, g):
        self.velocity[0] = g.near(self.radius).count + g.uniform("draw")


class Replace(Interaction):
    """In the first step remove entity 1, and ask for another."""

    def step(self, w):
        first = (w.id == 1) & (w.step_count[w.world] == 0)
        w.kill(first, "replaced")
        w.spawn("a", w.world[first])


def boids():
    return block(
        "a", count=5, variance=(9.0, 9.0, 9.0), autonomy=Boids(comms_range=0.5), motion=Unicycle(vel_max=20.0)
    )


@pytest.mark.parametrize(
    ("of", "params"),
    [
        (block("a", count=5, variance=(1.0, 1.0, 1.0), autonomy=Wander()), {"a.Wander.spread": 2.0}),
        (block("a", count=9, variance=(1.0, 1.0, 1.0), autonomy=Look()), {"a.Look.radius": 2.0}),
        (boids(), {"a.Boids.comms_range": 200.0, "a.speed": 4.0}),
    ],
    ids=["draws", "radius", "law"],
)
@pytest.mark.parametrize("update", ["synchronous", "sequential"])
def test_same_ids_keep_arrays_but_no_draws_and_reaches(of, params, update):
    game = mission(of, update=update)
    sim = Simulation(game, seeds=[1, 2, 3])
    sim.step(3)
    bodies, view = sim.state.population.bodies, sim.state.population.groups[0].autonomy_view
    held, pos = bodies.ints, view.pos
    sim.reset([1], [7], params)
    assert bodies.ints is held
    assert view.pos is pos
    sim.run()
    fresh = [alone(game, 1), alone(game, 7, params), alone(game, 3)]
    assert [r.state_hash for r in sim.result()] == [one.state_hash() for one in fresh]


def test_other_ids_in_the_same_places_leave_those_that_somebody_holds_as_they_were():
    game = mission(boids(), interactions=[Replace()])
    sim = Simulation(game, seeds=range(3))
    sim.step(3)
    held = sim.state.population.bodies.ints
    before = held.copy()
    assert before[0].tolist() == [2, 3, 4, 5, 6] * 3
    sim.reset([1], [7])
    assert sim.state.population.bodies.n == before.shape[1]
    assert sim.state.population.bodies.ints is not held
    assert np.array_equal(held, before)
    sim.run()
    assert sim.state_hash(1) == alone(game, 7).state_hash()
