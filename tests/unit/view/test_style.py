"""Colours and models come from the mission where it says so."""

import pytest

from tussle.palette import TEAM_COLOURS, rgb_of
from tussle.view import MODELS, Style

PALETTE = tuple(map(rgb_of, TEAM_COLOURS))


def looks(plugins=("Unicycle",), team=1, **entity):
    return Style(["robot"], [team], [plugins], {"entities": {"robot": entity}} if entity else {})


@pytest.mark.parametrize(
    ("name", "model"),
    [
        ("zephyr-blue", "aircraft"), ("zephyr-red", "aircraft"), ("cessna", "aircraft"), ("F15", "aircraft"),
        ("iris", "quadrotor"), ("MyQuadRotor", "quadrotor"), ("quadcopter", "quadrotor"), ("quad", "quadrotor"),
        ("volkswagen", "car"), ("car", "car"), ("pioneer3at", "car"), ("clearpath_husky", "car"),
        ("sea-angler", "boat"), ("USV", "boat"), ("kayak2", "boat"),
        ("sphere", "sphere"), ("Sphere", "sphere"), ("Ball", "sphere"),
        ("zefyr", "aircraft"), ("folkswagen", "car"),
    ],
)  # fmt: skip
def test_models_of_existing_missions_become_the_nearest(name, model):
    found = looks(visual_model=name)
    assert found.model(0) == model
    assert found.notes == []
    assert model in MODELS


@pytest.mark.parametrize(
    ("plugins", "model"),
    [
        (("Boids", "DirectController", "Unicycle"), "aircraft"),
        (("WaypointGenerator", "SimpleAircraft"), "aircraft"),
        (("Multirotor",), "quadrotor"),
        (("SimpleQuadrotor",), "quadrotor"),
        (("MotorSchemas", "SimpleCar"), "car"),
        (("LaggedCar",), "car"),
        (("WaypointDispatcher", "SingleIntegrator"), "sphere"),
        (("Still",), "sphere"),
        ((), "sphere"),
    ],
)
def test_without_one_the_motion_model_decides(plugins, model):
    assert looks(plugins).model(0) == model


def test_a_model_like_nothing_here_is_told():
    found = looks(("SimpleCar",), visual_model="xqy")
    assert found.model(0) == "car"
    assert found.notes == ["block 'robot': visual_model 'xqy' is unknown; it is drawn as car"]


def test_colours_of_blocks_and_teams():
    settings = {"entities": {"b": {"color": "1 2 3"}, "c": {"color": "4, 5, 255"}}}
    found = Style(["a", "b", "c", "d"], [1, 1, 1, 2], viewer=settings)
    assert [found.block_colour(i) for i in range(4)] == [(1, 2, 3), (1, 2, 3), (4, 5, 255), PALETTE[1]]
    assert found.colour(1) == (1, 2, 3)
    assert found.colour(2) == PALETTE[1]
    assert found.notes == []


def test_teams_without_colours_differ_whatever_their_numbers():
    found = Style([], [])
    assert len({found.colour(team) for team in range(1, 8)}) == 7
    assert found.colour(0) in PALETTE
    assert found.colour(-5) in PALETTE
    assert found.colour(8) == found.colour(1)


@pytest.mark.parametrize("text", ["red", "1 2", "1 2 300", "1 2 3 4", "-1 2 3", ""])
def test_colours_that_are_none_are_told(text):
    found = looks(color=text)
    assert found.block_colour(0) == PALETTE[0]
    assert len(found.notes) == 1
    assert repr(text) in found.notes[0]


def test_scale():
    assert looks(visual_scale="2.5").scale(0) == 2.5
    assert looks().scale(0) == 1.0
    for text in ("0", "-1", "big", "inf", "nan"):
        found = looks(visual_scale=text)
        assert found.scale(0) == 1.0
        assert repr(text) in found.notes[0]
