"""The battery: what empties it, what an empty one does, how it is charged."""

from __future__ import annotations

import numpy as np
import pytest
from six_degrees import Pilot, seen

from tussle import Block, Mission, Simulation, stock
from tussle.api import Autonomy, EntityRef, Output, Publish, Subscribe
from tussle.api.channel_map import CHANNEL_UNITS, channel_rows
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


@pytest.mark.parametrize("name", ["SimpleCar", "SimpleQuadrotor", "DubinsAirplane", "Multirotor"])
def test_it_passes_the_channels_of_any_vehicle(name):
    """Each is discharged by a command of its own, and limits it."""
    vehicle = getattr(stock, name)()
    channels = [c for k in vehicle.active_inputs() for c in type(vehicle).inputs()[k].channels]
    body = {c: Output(unit=CHANNEL_UNITS[c]) for c in channels}
    driver = type(
        "Steers" + name,
        (Autonomy,),
        {**body, "step": lambda self, g: [getattr(self, c).fill(0.1) for c in channels]},
    )
    rows = " ".join(f"[ {c}, 0.5, NonZero, true, 0.0 ]" for c in channels)
    entity = Block(
        name="a", position=(0, 0, 50), autonomy=driver(), controller=MotionBattery(depletion_map=rows), motion=vehicle
    )  # fmt: skip
    sim = Simulation(Mission(blocks=[entity], dt=0.1, end=2.0))
    sim.step()
    assert seen(sim, "MotionBattery.charge") == pytest.approx(max(1.0 - 0.05 * len(channels), 0.0))
    sim.step(25)
    assert seen(sim, "MotionBattery.charge") == 0.0


def test_inputs_of_a_joystick_or_autopilot_drive_any_channel():
    assert channel_rows("[steering 0 -1 1 -0.5 0.5 1]")[0].value(1.0) == 0.5
    with pytest.raises(ParameterError, match="did you mean 'steering'"):
        channel_rows("[steerin 0 -1 1 -0.5 0.5 1]")
