"""The battery: what empties it, what an empty one does, how it is charged."""

from __future__ import annotations

import numpy as np
import pytest
from six_degrees import Pilot, seen

from tussle import Block, Mission, Simulation
from tussle.api import Autonomy, EntityRef, Publish, Subscribe
from tussle.errors import ParameterError, WiringError
from tussle.messages import ChargeAdded, ChargePercentage
from tussle.stock import MotionBattery, Unicycle, UnicyclePID


class Charger(Autonomy):
    """Charges entity 1 in step 10 and hears its charge."""

    charger = Publish(ChargeAdded)
    heard = Subscribe(ChargePercentage, network="LocalNetwork")
    target = EntityRef()

    def step(self, g):
        rows, heard = self.heard.pairs()
        assert np.all((heard.percentage >= 0.0) & (heard.percentage <= 100.0))
        self.target[rows] = g.id[rows]
        now = np.flatnonzero(g.step_count == 10)
        self.charger.publish(now, entity=np.ones(len(now), int), charge=np.full(len(now), 0.3))


def game(battery, substeps=1, **pilot):
    entity = Block(
        name="a", autonomy=[Pilot(speed=5.0, **pilot), Charger()], controller=[battery, UnicyclePID()], motion=Unicycle(vel_max=9.0)
    )  # fmt: skip
    return Simulation(Mission(blocks=[entity], dt=0.1, end=10.0, motion_multiplier=substeps))


@pytest.mark.parametrize("substeps", [1, 4])
def test_speed_empties_the_battery_and_an_empty_one_stops(substeps):
    sim = game(MotionBattery(), substeps)
    sim.step(8)
    assert seen(sim, "MotionBattery.charge") == pytest.approx(1.0 - 0.8)
    assert seen(sim, "vel")[0] == pytest.approx(5.0)
    sim.step(3)
    assert seen(sim, "MotionBattery.charge") == 0.0
    assert seen(sim, "vel")[0] == 0.0
    sim.step(2)  # the charge of step 10 arrives once, whatever the number of substeps
    assert 0.0 < seen(sim, "MotionBattery.charge") <= 0.3
    assert seen(sim, "vel")[0] == pytest.approx(5.0)
    sim.step(5)
    assert seen(sim, "vel")[0] == 0.0


def test_changes_take_charge_of_type_delta():
    text = "[ desired_speed, 0, Delta, false, 0 ] [ desired_altitude, 0.01, Delta, false, 0 ] [ desired_heading, 0, NonZero, true, 0 ]"
    sim = game(MotionBattery(depletion_map=text, publish_charge=True), altitude=10.0)
    sim.step(2)
    assert seen(sim, "MotionBattery.charge") == 1.0  # the first value is no change
    sim.write("a.Pilot.altitude", 30.0)
    sim.step(2)
    assert seen(sim, "MotionBattery.charge") == pytest.approx(0.8)
    assert seen(sim, "Charger.target") == 1


def test_channels_that_are_not_in_the_map_are_not_passed():
    with pytest.raises(WiringError, match="no plugin writes channel 'desired_altitude' for UnicyclePID"):
        game(MotionBattery(depletion_map="[ desired_speed, 1, NonZero, true, 0 ]"))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[ desired_sped, 1, NonZero, true, 0 ]", "no channel 'desired_sped'.*desired_speed"),
        ("[ desired_speed, 1, Sometimes, true, 0 ]", "is not .channel, rate, NonZero or Delta"),
        ("[ desired_speed, 1, NonZero, true ]", "is not .channel, rate, NonZero or Delta"),
        ("", "names no channel"),
    ],
)
def test_what_is_no_map_is_refused(text, message):
    with pytest.raises(ParameterError, match=r"MotionBattery.depletion_map: .*" + message):
        MotionBattery(depletion_map=text)
