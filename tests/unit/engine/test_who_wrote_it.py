"""Errors about states that are not finite name who wrote them; declarations that cannot work are refused."""

from __future__ import annotations

import math

import numpy as np
import pytest
from small_worlds import Drift, mission

from tussle import Block, Simulation
from tussle.api import Autonomy, EntityRef, Interaction, Output, Param, service
from tussle.errors import DeclarationError, PluginError, TussleError
from tussle.stock import SingleIntegrator, Unicycle
from tussle.testing import check_plugin


class Beam(Interaction):
    """Moves everybody to a place."""

    def step(self, w):
        w.move(np.arange(w.n), pos=np.full((3, w.n), math.nan))


class Heal(Interaction):
    """Writes health."""

    def step(self, w):
        w.bodies.health[:] = np.where(w.step_count[w.world] > 1, math.nan, 1.0)


class Bystander(Interaction):
    """Does nothing wrong."""

    def step(self, w):
        w.bodies.health[:] = 1.0


class Wrong(Unicycle):
    """A motion model that leaves the numbers."""

    def to_body(self, body):
        if (body.t > 0.15).any():
            self.x[0] = math.nan
        super().to_body(body)


def error_of(*interactions, motion=None):
    """The failure of a world."""
    block = Block(name="r", autonomy=Drift(to=(1.0, 0.0, 0.0)), motion=SingleIntegrator())
    if motion is not None:
        block = Block(name="r", motion=motion, autonomy=Turn())
    sim = Simulation(mission(block, interactions=interactions, dt=0.1, end=1.0), seeds=1)
    with pytest.raises(PluginError) as error:
        sim.run()
    return str(error.value)


class Turn(Autonomy):
    """Drives on."""

    out = Output("speed turn_rate pitch_rate", unit="m/s rad/s rad/s")

    def step(self, g):
        self.out[:] = 0.0


def test_the_interaction_that_moved_it_or_wrote_its_health_is_named():
    assert error_of(Beam()).startswith("Beam, r 1, world 0, step 0: w.move: pos is not finite")
    assert error_of(Bystander(), Beam()).startswith("Beam, ")
    text = error_of(Heal())
    assert text.startswith("Heal, r 1, world 0, step 2: ")
    assert "health = nan" in text
    assert "so is the state of its motion model, SingleIntegrator" in text
    assert error_of(Bystander(), Heal()).startswith("Bystander or Heal, ")


def test_the_motion_model_is_named_where_its_own_state_is_wrong():
    assert error_of(Bystander(), motion=Wrong()).startswith("Wrong, r 1, world 0, step 2: ")


def test_a_world_plugin_has_no_references():
    with pytest.raises(DeclarationError, match=r"Keeper\.target: a world plugin has no EntityRef"):

        class Keeper(Interaction):
            target = EntityRef()


def test_a_column_cannot_hide_a_hook_and_other_names_are_free():
    with pytest.raises(DeclarationError, match=r"Late\.start: WorldPlugin has a method of this name"):

        class Late(Interaction):
            start = Param(1.0, unit="s")

    class Begin(Autonomy):
        """Drives from a place."""

        start = Param(1.0, unit="m/s")
        velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

        def step(self, g):
            self.velocity[0] = self.start

    check_plugin(Begin)


class Depot(Interaction):
    """Knows a number."""

    stock = Param(1.0)

    @service
    def level(self):
        return float(self.stock[0])


class Ask(Autonomy):
    """Asks for a service."""

    of = Param("level")
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    def step(self, g):
        self.velocity[0] = g.call(self.of)


def test_a_service_of_several_plugins_is_called_by_plugin_and_name():
    def speed(of, *depots):
        block = Block(name="r", autonomy=Ask(of=of), motion=SingleIntegrator())
        sim = Simulation(mission(block, interactions=depots, dt=0.1, end=1.0), seeds=1, on_error="raise")
        sim.step()
        return sim.read("r.vel")[0][0, 0, 0]

    two = Depot(name="east", stock=2.0), Depot(name="west", stock=3.0)
    assert speed("level", Depot(stock=4.0)) == 4.0
    assert (speed("east.level", *two), speed("west.level", *two)) == (2.0, 3.0)
    with pytest.raises(
        TussleError, match=r"several plugins offer the service 'level'; call one of east\.level, west\.level"
    ):
        speed("level", *two)
