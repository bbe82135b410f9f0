"""What is said to a game from outside reaches its plugins, and snapshots keep it."""

import numpy as np
import pytest
from watched_plugins import GoWhereClicked

from tussle import Block, Mission, Simulation
from tussle.api import Autonomy, EntityRef, Interaction, Publish, State, Subscribe
from tussle.errors import ParameterError, WiringError
from tussle.messages import (
    CustomKeyPress,
    ManualControl,
    Message,
    RemoveEntity,
    SpawnEntity,
    WorldPointClicked,
)
from tussle.record.inputs import ExternalInput
from tussle.stock import GlobalNetwork, LocalNetwork, SingleIntegrator, Still


class CountsClicks(Interaction):
    """Counts what it sees in the step in which it is said."""

    clicks = State(dtype=int, per="world")
    keys = State(dtype=int, per="world")
    step_of_click = State(dtype=int, per="world")

    def step(self, w):
        for world in w.inbox(WorldPointClicked).world:
            self.clicks[world] += 1
            self.step_of_click[world] = w.step_count[world]
        for world, key in zip(w.inbox(CustomKeyPress).world, w.inbox(CustomKeyPress).key, strict=True):
            self.keys[world] += ord(key)


def game(seeds=1, **changes):
    block = Block(
        name="drone", team=1, count=3, autonomy=GoWhereClicked(), motion=SingleIntegrator(max_speed=50.0)
    )
    mission = Mission(blocks=[block], interactions=[CountsClicks()], end=20.0).replace(**changes)
    return Simulation(mission, seeds)


def test_a_click_is_heard_in_the_next_step_and_acted_upon_in_the_one_after():
    sim, other = game(), game()
    sim.step(3)
    other.step(3)
    sim.publish(WorldPointClicked, pos=(100.0, 50.0, 20.0))
    assert sim.read("CountsClicks.clicks")[0] == [0]
    sim.step()
    other.step()
    assert sim.read("CountsClicks.clicks")[0] == [1]
    assert sim.read("CountsClicks.step_of_click")[0] == [3]
    np.testing.assert_array_equal(sim.read("drone.pos")[0], other.read("drone.pos")[0])
    sim.step(150)
    np.testing.assert_allclose(sim.read("drone.pos")[0][0], [[100.0, 50.0, 20.0]] * 3, atol=5.0)


def test_a_key_carries_its_name():
    sim = game()
    sim.publish(CustomKeyPress, key="k")
    sim.step()
    assert sim.read("CountsClicks.keys")[0] == [ord("k")]


def test_it_is_said_in_the_worlds_that_are_asked_for_and_in_none_that_has_ended():
    sim = game(seeds=[1, 2, 3])
    sim.publish(WorldPointClicked, [0, 2], pos=np.array([[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]]))
    sim.step()
    assert sim.read("CountsClicks.clicks")[0].tolist() == [1, 0, 1]
    sim.publish(WorldPointClicked, pos=(1, 2, 3))
    sim.step(2)
    assert sim.read("CountsClicks.clicks")[0].tolist() == [2, 1, 2]
    sim.run()
    before = [sim.state_hash(w) for w in range(3)]
    sim.publish(WorldPointClicked, pos=(1, 2, 3))
    sim.publish(WorldPointClicked, [1], pos=(1, 2, 3))
    sim.step()
    assert [sim.state_hash(w) for w in range(3)] == before


def test_a_snapshot_keeps_what_has_been_said_and_the_hash_knows_it():
    sim = game()
    sim.step(2)
    silent = sim.state_hash()
    sim.publish(WorldPointClicked, pos=(100.0, 50.0, 20.0))
    told = sim.state_hash()
    assert told != silent
    saved = sim.snapshot()
    sim.step(30)
    future = sim.state_hash()
    sim.restore(saved)
    assert sim.state_hash() == told
    sim.step(30)
    assert sim.state_hash() == future
    assert sim.read("CountsClicks.clicks")[0] == [1]


def test_a_world_that_begins_anew_has_forgotten_it_and_the_others_have_not():
    sim = game(seeds=[1, 2])
    sim.step()
    sim.publish(WorldPointClicked, pos=(100.0, 50.0, 20.0))
    sim.reset([0])
    sim.step()
    assert sim.read("CountsClicks.clicks")[0].tolist() == [0, 1]


def test_what_cannot_be_said():
    sim = game()
    with pytest.raises(ParameterError, match="has no field 'position'"):
        sim.publish(WorldPointClicked, position=(1, 2, 3))
    with pytest.raises(WiringError, match="did you mean 'GlobalNetwork'"):
        sim.publish(WorldPointClicked, network="GlobalNetwerk", pos=(1, 2, 3))
    with pytest.raises(WiringError, match="carries WorldPointClicked, not CustomKeyPress"):
        sim.publish(CustomKeyPress, topic="WorldPointClicked", key="k")


REFERRING = [
    (type_, name)
    for type_ in Message.__subclasses__()
    if type_.__module__ == Message.__module__
    for name, column in type_.fields.items()
    if isinstance(column, EntityRef)
]


@pytest.mark.parametrize(("type_", "name"), REFERRING, ids=lambda each: getattr(each, "__name__", each))
@pytest.mark.parametrize("wrong", [-1, 4, 2**62])
def test_no_message_names_an_entity_that_never_was(type_, name, wrong):
    with game(seeds=[1, 2]) as sim:
        before = sim.state_hash()
        others = {each: 1 for kind, each in REFERRING if kind is type_} | {name: [3, wrong]}
        with pytest.raises(
            ParameterError, match=rf"{type_.__name__}: {name} = {wrong} .*no entity of world 1 .* to 3"
        ):
            sim.publish(type_, **others)
        assert sim.state_hash() == before
        sim.publish(type_, **others | {name: 3})


@pytest.mark.parametrize("type_", [RemoveEntity, ManualControl])
def test_a_request_about_nobody_is_refused_and_one_about_the_dead_is_not(type_):
    with game() as sim:
        with pytest.raises(ParameterError, match=r"entity = 0 is not allowed.*ids are 1 to 3$"):
            sim.publish(type_)
        sim.publish(RemoveEntity, entity=2, why="test")
        sim.step()
        sim.publish(type_, entity=2)
        sim.step()
        assert sim.state.population.bodies.id.tolist() == [1, 3]


def test_a_recording_from_before_such_requests_were_refused_is_still_played():
    with game() as sim:
        sim.play_inputs([ExternalInput(0, "message", "RemoveEntity", {"entity": 77, "why": "test"})])
        sim.step(2)
        assert sim.state.population.bodies.id.tolist() == [1, 2, 3]


@pytest.mark.parametrize(
    ("fields", "text"),
    [
        ({"block": "dron"}, r"SpawnEntity: there is no block 'dron' \(did you mean 'drone'\?\)"),
        ({"block": "drone", "pos": (0, 0, np.nan)}, "SpawnEntity: pos"),
    ],
)
def test_a_birth_that_cannot_be_is_refused_before_the_step(fields, text):
    with game() as sim, pytest.raises(ParameterError, match=text):
        sim.publish(SpawnEntity, **fields)


class Calls(Autonomy):
    """Call every step."""

    said = Publish(CustomKeyPress, network="LocalNetwork")

    def step(self, g):
        self.said.publish(np.arange(g.n), key="a")


class Hears(Autonomy):
    """Listen on another network."""

    said = Subscribe(CustomKeyPress, network="GlobalNetwork")

    def step(self, g):
        assert not self.said


def test_a_pair_on_two_networks_is_told():
    block = Block(name="pair", team=1, count=2, autonomy=[Calls(), Hears()], motion=Still())
    mission = Mission(blocks=[block], networks=[LocalNetwork(), GlobalNetwork()], end=1.0)
    text = r"'CustomKeyPress' is published on network 'LocalNetwork' and subscribed to on network 'GlobalNetwork'"
    with pytest.warns(RuntimeWarning, match=text):
        Simulation(mission)
