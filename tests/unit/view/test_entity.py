"""What is told of an entity is what its plugins hold and what it has heard."""

import numpy as np
import pytest
from missions import mission
from recorded_games import hunt
from watched_plugins import clickable

from tussle import Simulation
from tussle.errors import ParameterError
from tussle.messages import WorldPointClicked
from tussle.view.entity import entity_state


@pytest.mark.parametrize(
    "name", ["chase_synchronous", "chase_sequential", "births_and_radio", "schemas", "aircraft"]
)
def test_body_and_plugins_are_what_reading_by_path_gives(name):
    sim = Simulation(mission(name), seeds=[4, 5])
    sim.step(17)
    n_columns = 0
    for block in sim.state.context.block_names:
        ids, alive = sim.read(f"{block}.id")
        for place in np.flatnonzero(alive[1])[:3]:
            state = entity_state(sim, 1, int(ids[1, place]))
            assert (state.id, state.block, state.step) == (ids[1, place], block, 17)
            assert state.team == sim.read(f"{block}.team")[0][1, place]
            for column, reading in state.body.items():
                np.testing.assert_array_equal(reading.value, sim.read(f"{block}.{column}")[0][1, place])
            for plugin, columns in state.plugins.items():
                for column, reading in columns.items():
                    if column in ("contacts", "seen"):  # lists, see below
                        continue
                    try:
                        values = sim.read(f"{block}.{plugin}.{column}")[0][1, place]
                    except ParameterError:  # one value for all, no column
                        values = value_of_all(sim.mission, block, plugin, column)
                    np.testing.assert_array_equal(reading.value, values)
                    n_columns += 1
    assert n_columns > 20


def value_of_all(mission, block, path, column):
    """A structural parameter."""
    plugins = next(b for b in mission.blocks if b.name == block).plugins
    for name in path.split("."):
        plugin = next(p for p in plugins if p.instance_name == name)
        plugins = [c for k in type(plugin).children() for c in plugin.values[k]]
    return plugin.values[column]


def test_an_output_that_is_not_computed_is_not_shown():
    sim = Simulation(mission("chase_synchronous"))
    sim.step()
    boids = entity_state(sim, 0, 1).plugins["Boids"]
    assert "desired_heading" not in boids
    with pytest.raises(ParameterError, match="leaves out"):
        sim.read("prey.Boids.desired_heading")


def test_lists_are_one_line_per_item():
    sim = Simulation(mission("schemas"))
    sim.step(10)
    counts = set()
    for who in range(1, 13):
        sensor = entity_state(sim, 0, who).plugins["NoisyContacts"]
        contacts = sensor["contacts"]
        assert contacts.value.shape == (sensor["n_contacts"].value, len(contacts.fields))
        assert who not in contacts.value[:, contacts.fields.index("id")]
        counts.add(len(contacts.value))
    assert len(counts) > 1


def test_units_and_fields_are_those_declared():
    sim = Simulation(clickable())
    state = entity_state(sim, 0, 2)
    goal = state.plugins["GoWhereClicked"]["goal"]
    assert (goal.unit, goal.fields) == ("m", ("x", "y", "z"))
    speed = state.plugins["SingleIntegrator"]["max_speed"]
    assert (speed.value, speed.unit) == (20.0, "m/s")
    assert speed.doc.startswith("Largest speed")
    assert state.body["yaw"].unit == "rad"


def test_who_is_not_there():
    sim = Simulation(hunt())
    assert entity_state(sim, 0, 99) is None
    assert entity_state(sim, 0, 0) is None
    sim.run()
    gone = next(i for i in range(1, 16) if i not in sim.state.population.bodies.id)
    assert entity_state(sim, 0, gone) is None


def test_of_a_world_that_has_ended_the_last_state_is_told():
    sim = Simulation(hunt(n_prey=3, end=30.0), seeds=[1, 3])
    before = {}
    while sim.state.running[1]:
        before = {w: entity_state(sim, w, 5) for w in range(2)}
        sim.step()
    assert sim.state.running[0]
    state = entity_state(sim, 1, 5)
    assert state.step == sim.steps[1] == before[1].step + 1
    assert set(state.plugins) == set(before[1].plugins)
    target = state.plugins["Predator"]
    assert {k: type(r.value) for k, r in target.items()} == {
        k: type(r.value) for k, r in before[1].plugins["Predator"].items()
    }
    np.testing.assert_array_equal(state.body["pos"].value, sim.read("hunters.pos")[0][1, 1])


def test_messages_that_were_heard_and_said():
    sim = Simulation(mission("births_and_radio"), seeds=[7, 8])
    heard = said = 0
    for _ in range(20):
        sim.step()
        for who in range(1, 11):
            state = entity_state(sim, 1, who)
            expected = []
            for group in sim.state.population.groups:
                for binding in group.walk():
                    for value in binding.plugin.__dict__.values():
                        if hasattr(value, "pairs"):
                            rows, batch = value.pairs()
                            for row, i in zip(rows, range(batch.n), strict=True):
                                at = group.first + row
                                if (
                                    sim.state.population.bodies.world[at],
                                    sim.state.population.bodies.id[at],
                                ) == (1, who):
                                    expected.append((int(batch.sender[i]), tuple(batch.pos[:, i])))
            assert sorted((m.sender, tuple(m.fields["pos"])) for m in state.received) == sorted(expected)
            heard += len(expected)
            for message in state.sent:
                assert message.topic == "SphereNetwork/Waypoint"
                assert message.sender == who
                said += 1
    assert heard > 20
    assert said > 20


def test_what_the_world_says_is_heard_by_all():
    sim = Simulation(clickable(), seeds=[1, 2])
    sim.publish(WorldPointClicked, [1], pos=(1.0, 2.0, 3.0))
    sim.step()
    assert entity_state(sim, 0, 1).received == []
    (message,) = entity_state(sim, 1, 1).received
    assert (message.topic, message.sender) == ("GlobalNetwork/WorldPointClicked", 0)
    assert message.fields["pos"].tolist() == [1.0, 2.0, 3.0]
    sim.step()
    assert entity_state(sim, 1, 1).received == []
