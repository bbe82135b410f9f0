"""Missions and blocks: what they take, and what is said about what they do not."""

from __future__ import annotations

import pickle

import pytest
from small_worlds import Drift, block, mission

from tussle import Block, Mission
from tussle.errors import MissionError
from tussle.stock import (
    DirectController,
    GlobalNetwork,
    LocalNetwork,
    NoisyState,
    SimpleCapture,
    SimpleCaptureMetrics,
    SingleIntegrator,
)

MOTION = {"motion": SingleIntegrator(), "autonomy": Drift()}


def test_numbers_are_understood_with_units():
    made = Block(
        name="a",
        position=("1 km", 0, "30 ft"),
        heading="180 deg",
        speed="40 kt",
        rate="2 Hz",
        first_birth="1 min",
        **MOTION,
    )
    assert made.position == pytest.approx((1000.0, 0.0, 9.144))
    assert made.heading == pytest.approx(3.14159265)
    assert made.speed == pytest.approx(20.5777778)
    assert (made.rate, made.first_birth) == (2.0, 60.0)
    game = Mission(blocks=[made], dt="100 ms", end="2 min")
    assert (game.dt, game.end, game.steps) == (0.1, 120.0, 1200)


def test_missions_are_values():
    assert mission(block()) == mission(block())
    assert mission(block()) != mission(block(speed=1.0))
    assert pickle.loads(pickle.dumps(mission(block()))) == mission(block())
    assert mission(block()).replace(end=5.0).steps == 50
    with pytest.raises(AttributeError):
        mission(block()).end = 3.0


def test_one_plugin_or_several():
    assert block(autonomy=Drift()).autonomy == block(autonomy=[Drift()]).autonomy == (Drift(),)
    assert block(sensor=None).sensor == ()
    assert [p.instance_name for p in block(controller=DirectController(), sensor=[NoisyState()]).plugins] == [
        "Drift",
        "DirectController",
        "SingleIntegrator",
        "NoisyState",
    ]


def test_the_networks_to_everyone_and_within_an_entity_are_always_there_once():
    assert mission(block()).networks == (GlobalNetwork(), LocalNetwork())
    assert mission(block(), networks=[GlobalNetwork(comm_delay=0.5)]).networks == (
        LocalNetwork(),
        GlobalNetwork(comm_delay=0.5),
    )


@pytest.mark.parametrize(("end", "steps"), [(1.0, 10), (1.04, 10), (1.06, 11), (0.0, 0), (-1.0, 0)])
def test_steps_until_the_end(end, steps):
    assert mission(block(), end=end, end_conditions="none").steps == steps


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"name": ""}, r"block '': the name of a block must not be empty"),
        ({"name": "a.b"}, r"block 'a.b': the name of a block .* a dot"),
        ({"name": 5}, r"block 5: the name of a block must be a text"),
        ({"position": (1, 2)}, r"block 'a': position = \(1, 2\) is not allowed"),
        ({"position": None}, r"block 'a': position = None is not allowed; it takes 3 values"),
        ({"position": (1, 2, "3 kg")}, r"block 'a': position = '3 kg': .*kg"),
        ({"position": (1, 2, float("nan"))}, r"block 'a': position = nan is not allowed"),
        ({"position": (1e300, 0, 0)}, r"block 'a': position = 1e\+300 is not allowed; .* <= 1e\+09"),
        ({"variance": (0, 1e300, 0)}, r"block 'a': variance = 1e\+300 is not allowed"),
        ({"velocity": (1, 2)}, r"block 'a': velocity = \(1, 2\) is not allowed; it takes 3 values"),
        ({"variance": (1, -1, 0)}, r"block 'a': variance = -1 is not allowed"),
        ({"half_width": -1}, r"block 'a': half_width"),
        ({"heading": "3 m"}, r"block 'a': heading = '3 m': '3 m' is in m, not convertible to rad"),
        ({"heading": [1]}, r"block 'a': heading = \[1\] is not allowed"),
        ({"heading": None}, r"block 'a': heading = None is not allowed"),
        ({"speed": -1}, r"block 'a': speed = -1 is not allowed; it takes a finite number in m/s >= 0"),
        ({"heading_variance": -1}, r"heading_variance = -1 is not allowed"),
        ({"interval_sd": -1}, r"interval_sd = -1 is not allowed"),
        ({"health": 0}, r"block 'a': health = 0 is not allowed; it takes a finite number > 0"),
        ({"health": None}, r"block 'a': health = None is not allowed"),
        ({"radius": 0}, r"radius = 0 "),
        ({"mass": -2}, r"mass = -2 "),
        ({"rate": 0}, r"rate = 0 "),
        ({"slots": 0}, r"slots = 0"),
        ({"count": 2.5}, r"block 'a': count = 2.5 is not allowed; it takes a whole number"),
        ({"count": "many"}, r"block 'a': count = 'many' is not allowed; it takes a whole number"),
        ({"count": None}, r"block 'a': count = None is not allowed; it takes a whole number"),
        ({"count": float("nan")}, r"block 'a': count = nan is not allowed; it takes a whole number"),
        ({"count": True}, r"block 'a': count = True is not allowed"),
        ({"team": 1.5}, r"block 'a': team = 1.5 is not allowed; it takes a whole number"),
        ({"placement": "gauss"}, r"block 'a': placement = 'gauss' is not allowed"),
        ({"motion": None}, r"block 'a': motion = None is not a motion model; each block has exactly one"),
        ({"motion": SingleIntegrator}, r"is not a motion model"),
        ({"motion": Drift()}, r"motion = Drift\(\) is not a motion model"),
        ({"autonomy": Drift}, r"block 'a': autonomy: .* is not of kind Autonomy \(it is a class"),
        (
            {"autonomy": SingleIntegrator()},
            r"block 'a': autonomy: SingleIntegrator\(\) is not of kind Autonomy",
        ),
        ({"controller": "UnicyclePID"}, r"block 'a': controller: 'UnicyclePID' is not of kind Controller"),
        ({"sensor": Drift()}, r"block 'a': sensor: Drift\(\) is not of kind Sensor"),
        ({"autonomy": [Drift(), Drift()]}, r"two plugins are called 'Drift'"),
        ({"autonomy": [Drift(name="SingleIntegrator")]}, r"two plugins are called 'SingleIntegrator'"),
    ],
)
def test_blocks_that_cannot_be(values, message):
    with pytest.raises(MissionError, match=message):
        Block(**{"name": "a", **MOTION, **values})


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"end": 1e30, "dt": 1e-300}, r"mission: end = 1e\+30 with dt = 1e-300 is not allowed"),
        ({"blocks": [5]}, r"mission: 5 is not a Block"),
        ({"blocks": 5}, r"mission: blocks = 5 is not allowed; it takes a list of Block"),
        ({"blocks": block()}, r"mission: blocks = <Block .* is not allowed; it takes a list of Block"),
        ({"blocks": [block(), block()]}, r"mission: two blocks are called 'a'"),
        ({"dt": 0}, r"mission: dt = 0 is not allowed; it takes a finite number in s > 0"),
        ({"dt": "3 m"}, r"mission: dt = '3 m': '3 m' is in m, not convertible to s"),
        ({"dt": None}, r"mission: dt = None is not allowed"),
        ({"end": float("inf")}, r"mission: end = inf is not allowed; it takes a finite number in s"),
        ({"motion_multiplier": 0}, r"mission: motion_multiplier = 0 is not allowed"),
        ({"motion_multiplier": 1.5}, r"motion_multiplier = 1.5"),
        ({"motion_multiplier": "two"}, r"mission: motion_multiplier = 'two' is not allowed"),
        ({"motion_multiplier": None}, r"mission: motion_multiplier = None is not allowed"),
        ({"update": "async"}, r"mission: update = 'async' is not allowed"),
        (
            {"end_conditions": "time, one_taem"},
            r"mission: end_conditions = 'one_taem' is not allowed \(did you mean 'one_team'\?\)",
        ),
        ({"end_conditions": 5}, r"mission: end_conditions = 5 is not allowed"),
        (
            {"interactions": SimpleCaptureMetrics()},
            r"mission: interactions: SimpleCaptureMetrics\(\) is not of kind Interaction",
        ),
        ({"metrics": [SimpleCapture()]}, r"mission: metrics: SimpleCapture\(\) is not of kind Metric"),
        ({"networks": "GlobalNetwork"}, r"mission: networks: 'GlobalNetwork' is not of kind Network"),
        (
            {"interactions": [SimpleCapture(), SimpleCapture()]},
            r"mission: interactions: two plugins are called 'SimpleCapture'",
        ),
        (
            {"interactions": SimpleCapture(name="x"), "metrics": SimpleCaptureMetrics(name="x")},
            r"two plugins are called 'x'",
        ),
        ({"interactions": SimpleCapture(name="a")}, r"mission: 'a' is the name of a block and of a plugin"),
        ({"scene": "flat"}, r"mission: scene = 'flat' is not a Scene"),
    ],
)
def test_missions_that_cannot_be(values, message):
    with pytest.raises(MissionError, match=message):
        Mission(**{"blocks": [block()], **values})


def test_missing_arguments_are_named():
    with pytest.raises(MissionError, match=r'^a Block needs name, such as Block\(name="prey"\)$'):
        Block(team=1)
    with pytest.raises(MissionError, match=r"^a Mission needs blocks, such as Mission\(blocks="):
        Mission()
    assert repr(Block.__new__(Block)).startswith("<")  # as a debugger shows it


def test_unknown_arguments_are_refused():
    with pytest.raises(MissionError, match=r"Block has no 'sped' \(did you mean 'speed'\?\)"):
        block(sped=3)
    with pytest.raises(MissionError, match=r"Mission has no 'ned' \(did you mean 'end'\?\)"):
        Mission(blocks=[block()], ned=3.0)
    with pytest.raises(MissionError, match="Mission has no 'foo'"):
        Mission(blocks=[block()]).replace(foo=3)
    with pytest.raises(MissionError, match="Block has no 'foo'"):
        block().replace(foo=3)
    assert block().replace(count=7).count == 7
