"""Calls that users insert into the schedule of a step."""

import numpy as np
import pytest

from tussle import Block, Mission, Simulation
from tussle.api import Autonomy, Output
from tussle.errors import ParameterError
from tussle.stock import Unicycle


class Fast(Autonomy):
    """Wants 20 m/s."""

    speed = Output(unit="m/s")
    turn_rate = Output(unit="rad/s")
    pitch_rate = Output(unit="rad/s")

    def step(self, g):
        self.speed[:] = 20.0


def mission(**more):
    block = Block(name="a", count=2, speed=5.0, autonomy=Fast(), motion=Unicycle(vel_max=50.0))
    late = [Block(name="b", rate=1.0, first_birth=0.5, autonomy=Fast(), motion=Unicycle())] if more else []
    return Mission(blocks=[block, *late], dt=0.1, end=2.0)


def test_a_call_reads_and_writes_between_autonomies_and_motion():
    sim, seen = Simulation(mission()), []

    def half_speed(simulation):
        wanted, _ = simulation.read("a.Fast.speed")
        seen.append(wanted.copy())
        simulation.write("a.Fast.speed", 0.5 * wanted)

    sim.schedule.insert(before="motion", call=half_speed)
    other = Simulation(mission())
    sim.step(3)
    other.step(3)
    assert np.all(seen == np.full((3, 1, 2), 20.0))
    moved, alone = (np.linalg.norm(each.read("a.vel")[0], axis=-1) for each in (sim, other))
    assert np.allclose(moved, 10.0)
    assert np.allclose(alone, 20.0)
    labels = [call.label for call in sim.schedule]
    assert labels.index("half_speed") == labels.index("motion       a: Unicycle") - 1
    assert "half_speed" in sim.describe()


@pytest.mark.parametrize(
    ("place", "neighbour"),
    [
        ({"before": "autonomy"}, 1),
        ({"after": "autonomy"}, -1),
        ({"before": "Fast"}, 1),
        ({"after": "autonomy     a: Fast"}, -1),
    ],
)
def test_a_place_is_a_kind_a_plugin_or_a_label(place, neighbour):
    sim = Simulation(mission())
    call = sim.schedule.insert(**place, call=lambda simulation: None, name="mine")
    at = list(sim.schedule).index(call)
    assert sim.schedule[at + neighbour].label == "autonomy     a: Fast"
    assert sim.schedule[at : at + 1] == [call]


def test_what_is_inserted_stays_when_the_schedule_is_made_anew_and_goes_when_removed():
    sim, steps = Simulation(mission()), []
    first = sim.schedule.insert(after="motion", call=lambda s: steps.append("first"), name="first")
    second = sim.schedule.insert(after="first", call=lambda s: steps.append("second"), name="second")
    sim.schedule.forget()
    sim.step()
    assert steps == ["first", "second"]
    with pytest.raises(ParameterError, match="'first' is the place of 'second', which is removed first"):
        sim.schedule.remove(first)
    sim.schedule.remove(second)
    sim.schedule.remove(first)
    sim.step()
    assert steps == ["first", "second"]
    assert [call.label for call in sim.schedule] == [call.label for call in Simulation(mission()).schedule]
    with pytest.raises(ParameterError, match="'first' is not an inserted call"):
        sim.schedule.remove(first)


def test_a_call_that_only_looks_changes_no_bit():
    sim, other = Simulation(mission()), Simulation(mission())
    sim.schedule.insert(before="motion", call=lambda s: s.read("a.pos"))
    sim.run()
    other.run()
    assert sim.state_hash() == other.state_hash()


def test_wrong_places_are_told():
    schedule = Simulation(mission()).schedule
    for place, text in (
        ({"before": "moton"}, "no call of the schedule is named 'moton'.*motion"),
        ({}, "exactly one of them"),
        ({"before": "motion", "after": "motion"}, "exactly one of them"),
    ):
        with pytest.raises(ParameterError, match=text):
            schedule.insert(**place, call=print)


def test_an_error_of_the_call_is_the_callers():
    sim = Simulation(mission(), seeds=[1, 2], on_error="record")

    def fails(simulation):
        raise KeyError("mine")

    sim.schedule.insert(before="motion", call=fails)
    with pytest.raises(KeyError, match="mine"):
        sim.step()


def test_new_blocks_join_before_what_is_inserted():
    sim = Simulation(mission(late=True))
    sim.schedule.insert(before="motion", call=lambda s: None, name="mine")
    sim.step(10)
    labels = [call.label for call in sim.schedule]
    kinds = [label.split()[0] for label in labels]
    assert kinds.index("mine") == kinds.index("motion") - 1
    assert labels.count("mine") == 1
