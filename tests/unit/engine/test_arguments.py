"""Numbers that `Simulation` takes: others are refused before anything happens, and nothing is rounded."""

import copy
import math
import pickle
import re

import numpy as np
import pytest

from tussle import Block, Mission, Simulation
from tussle.api import Autonomy, State
from tussle.errors import ParameterError, SnapshotError, TussleError
from tussle.messages import Waypoint
from tussle.stock import Still

MISSION = Mission(blocks=[Block(name="a", count=2, motion=Still())], end=1.0)
PLACE = {"pos": (1.0, 2.0, 3.0)}


@pytest.fixture(scope="module")
def simulation():
    with Simulation(MISSION, [1, 2, 3]) as made:
        yield made


WORLDS = [
    [3],
    [-1],
    [0.5],
    [True],
    ["a"],
    [None],
    1,
    0.5,
    "a",
    np.array([[0, 1]]),
    np.array([True, False, True]),
]
WORLD = [3, -1, 0.5, 1.0, True, "a", None]
SEEDS = [-1, 2**64, 1.5, True, "a", None, math.nan]
CALLS = {
    "step": (lambda s, v: s.step(v), [-1, 1.5, "3", None, True], "n = "),
    "run": (lambda s, v: s.run(v), [math.nan, "a", "5 s", True, [1.0]], "until = "),
    "worlds of reset": (lambda s, v: s.reset(v), [*WORLDS, [1, 1]], "reset: worlds = "),
    "seeds of reset": (lambda s, v: s.reset([0], [v]), SEEDS, "seed "),
    "worlds of publish": (lambda s, v: s.publish(Waypoint, v, **PLACE), WORLDS, "publish: worlds = "),
    "receivers of publish": (
        lambda s, v: s.publish(Waypoint, receivers=v, **PLACE),
        [1, 0.5, [1.0], "a", [True], [None]],
        "publish: receivers = ",
    ),
    "state_hash": (lambda s, v: s.state_hash(v), WORLD, "state_hash: world = "),
    "play_inputs": (lambda s, v: s.play_inputs([], v), WORLD, "play_inputs: world = "),
    "play_input": (lambda s, v: s.play_input(None, v), WORLD, "play_input: world = "),
    "restore": (lambda s, v: s.restore(v), ["a", None, {}], "restore takes what `snapshot` returned, not "),
    "seeds": (lambda s, v: Simulation(MISSION, [v]), SEEDS, "seed "),
    "threads": (lambda s, v: Simulation(MISSION, threads=v), [0, 1.5, "2", None, True], "threads = "),
}


@pytest.mark.parametrize("name", CALLS)
def test_what_is_not_such_a_number_is_refused(name, simulation):
    call, values, text = CALLS[name]
    before = simulation.state_hash(), simulation.steps.tolist()
    for value in values:
        with pytest.raises(TussleError, match=re.escape(text)) as found:
            call(simulation, value)
        assert "takes" in str(found.value) or "there are worlds 0 to 2" in str(found.value), value
    assert (simulation.state_hash(), simulation.steps.tolist()) == before


def test_numbers_of_numpy_are_numbers(simulation):
    simulation.step(np.int64(2))
    simulation.run(np.float32(0.3))
    simulation.reset(np.array([0, 2]), np.array([2**64 - 1, 5], np.uint64))
    simulation.publish(Waypoint, np.arange(2), **PLACE)
    assert simulation.state_hash(np.int64(1)) == simulation.state_hash(1)
    assert [each.seed for each in simulation.result()] == [2**64 - 1, 2, 5]
    assert simulation.steps.tolist() == [0, 3, 0]


@pytest.mark.parametrize(
    ("path", "value", "text"),
    [
        ("a.quat", (0.0, 0.0, 0.0, 0.0), "'a.quat': quat has the length 0; it takes quaternions of length 1"),
        ("a.quat", (1e200, 0.0, 0.0, 0.0), "quat has the length inf"),
        ("a.quat", (1.0, 1.0, 0.0, 0.0), "quat has the length 1.41421"),
        ("a.mass", 0.0, "'a.mass': values must be > 0"),
        ("a.radius", -1.0, "'a.radius': values must be > 0"),
        ("a.Marks.on", 2.5, "'a.Marks.on': values must be true or false"),
        ("a.Marks.on", [1, 7], "'a.Marks.on': values must be true or false"),
    ],
)
def test_what_a_column_cannot_hold_is_not_written(path, value, text):
    class Marks(Autonomy):
        on = State(dtype=bool)

        def step(self, g):
            pass

    with Simulation(Mission(blocks=[Block(name="a", count=2, autonomy=Marks(), motion=Still())])) as made:
        before = made.state_hash()
        with pytest.raises(ParameterError, match=re.escape(text)):
            made.write(path, value)
        assert made.state_hash() == before


@pytest.mark.parametrize("path", [None, 5, ("a", "pos"), b"a.pos"])
def test_a_path_is_a_text(path, simulation):
    calls = (
        lambda: simulation.read(path),
        lambda: simulation.write(path, 1.0),
        lambda: simulation.reset([0], params={path: 1.0}),
        lambda: Simulation(MISSION, params={path: 1.0}),
    )
    for call in calls:
        with pytest.raises(ParameterError, match=re.escape(f"{path!r} is no path; it takes a text")):
            call()


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy, pickle.dumps])
def test_a_simulation_is_not_copied_but_its_snapshot_is(copied, simulation):
    with pytest.raises(SnapshotError, match=r"neither copied nor pickled; snapshot\(\) returns its state"):
        copied(simulation)
    copied(simulation.snapshot())
