"""What a user types becomes the fields of a message, or is refused by name."""

import numpy as np
import pytest

from tussle import Block, Mission, Recorder, Simulation
from tussle.declare.columns import EntityRef, Field, Handle
from tussle.errors import ParameterError
from tussle.messages import Message, RoadGraph, TextMessage, WaypointList
from tussle.mission import Limits
from tussle.record import load_inputs
from tussle.scene import Cuboid, Scene
from tussle.stock import (
    GoTo,
    MotorSchemas,
    MoveToGoalMS,
    SceneCollision,
    SimpleCollision,
    SingleIntegrator,
    Still,
    WaypointDispatcher,
)
from tussle.view import Live
from tussle.view.entity import entity_state
from tussle.view.orders import MAX_ITEMS, MAX_TEXT, field_of, fields_from


class PlainNumbers(Message):
    """A list of single values."""

    plain = Field(dtype=int, ragged=True)


class Parcel(Message):
    """A stranger's message."""

    place = Field("x y z", "m m m")
    rows = Field("a b", "m 1", ragged=True)
    count = Field(dtype=int)
    is_urgent = Field(dtype=bool)
    who = EntityRef()
    label = Handle(is_text=True)
    thing = Handle(doc="An object.")


def test_values_of_all_kinds_are_those_of_the_message():
    given = {
        "place": [1, 2.5, -3], "rows": [[1, 2], [3, 4], [5, 6]], "count": -(2**62) - 1, "is_urgent": True, "who": 4, "label": "käse",
    }  # fmt: skip
    found = fields_from(Parcel, given)
    assert found["place"].tolist() == [1, 2.5, -3]
    assert found["rows"][0].tolist() == [[1, 3, 5], [2, 4, 6]]
    assert fields_from(PlainNumbers, {"plain": [7, 2**62 + 1]})["plain"][0].tolist() == [7, 2**62 + 1]
    assert (int(found["count"]), bool(found["is_urgent"]), int(found["who"]), found["label"]) == (
        -(2**62) - 1, True, 4, ["käse"],
    )  # fmt: skip
    assert fields_from(Parcel, {"rows": []})["rows"][0].shape == (2, 0)
    with Simulation(Mission(blocks=[Block(name="a", count=4, motion=Still())], end=1.0), 1) as simulation:
        simulation.publish(Parcel, **found)


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("place", [1, 2], "Parcel.place: it takes 3 numbers, x y z"),
        ("place", "1 2 3", "Parcel.place: it takes 3 numbers, x y z"),
        ("place", [1, 2, float("nan")], "Parcel.place: it takes 3 numbers, x y z"),
        ("place", [1, 2, True], "Parcel.place: it takes 3 numbers, x y z"),
        ("place", [1, 2, 10**400], "Parcel.place: it takes 3 numbers, x y z"),
        ("rows", [[1, 2], [3]], "Parcel.rows: it takes 2 numbers, a b"),
        ("rows", [[1, 2]] * (MAX_ITEMS + 1), f"Parcel.rows: it takes a list of at most {MAX_ITEMS} items"),
        ("rows", 3, "Parcel.rows: it takes a list"),
        ("count", 2**63, "Parcel.count: it takes a whole number"),
        ("is_urgent", 1, "Parcel.is_urgent: it takes true or false"),
        ("who", "drone 3", "Parcel.who: it takes the id of an entity"),
        ("label", 3, "Parcel.label: it takes a text"),
        ("label", "x" * (MAX_TEXT + 1), f"Parcel.label: it takes a text of at most {MAX_TEXT} characters"),
        ("thing", "x", r"Parcel has no field 'thing' that can be typed"),
        ("plase", [1, 2, 3], r"Parcel has no field 'plase' that can be typed \(did you mean 'place'\?\)"),
    ],
)
def test_what_does_not_fit_is_refused(name, value, reason):
    with pytest.raises(ParameterError, match=reason):
        fields_from(Parcel, {name: value})


def test_objects_cannot_be_typed():
    assert field_of("roads", RoadGraph.fields["roads"]) is None
    assert field_of("text", TextMessage.fields["text"]).kind == "text"


def test_stock_autonomies_take_orders():
    vehicle = {"motion": SingleIntegrator(max_speed=20.0)}
    blocks = [
        Block(name="one", autonomy=GoTo(), **vehicle),
        Block(name="list", autonomy=(WaypointDispatcher(), GoTo()), **vehicle),
        Block(name="schemas", autonomy=MotorSchemas(behaviors=[MoveToGoalMS()]), **vehicle),
    ]
    with Simulation(Mission(blocks=blocks, end=60.0, dt=0.1), 1) as simulation:
        orders = {
            entity_state(simulation, 0, who).block: entity_state(simulation, 0, who).orders
            for who in (1, 2, 3)
        }
        assert {name: [each.message for each in some if each.network] for name, some in orders.items()} == {
            "one": ["Waypoint"], "list": ["WaypointList", "Waypoint"], "schemas": ["TextMessage", "Waypoint"],
        }  # fmt: skip
        assert [f.name for f in orders["list"][0].fields] == list(WaypointList.fields)


def fleet(n=3):
    return Mission(
        name="fleet", end=60.0, dt=0.1,
        blocks=[
            Block(
                name=name, count=n, autonomy=GoTo(waypoints=[(500, 0, 0)], speed=10.0), motion=SingleIntegrator(max_speed=50.0),
                position=(0, y, 0), variance=(4, 4, 0),
            )
            for name, y in (("a", 0), ("b", 100))
        ],
    )  # fmt: skip


def test_a_parameter_is_set_for_some_entities_and_that_is_part_of_the_game(tmp_path):
    with (
        Simulation(fleet(), [1, 2]) as simulation, Recorder(simulation, tmp_path / "run") as recorder,
        Live(simulation, threaded=False, is_paused=True) as live,
    ):  # fmt: skip
        live.step(5)
        live.set_parameter([2, 4], "GoTo.speed", 30)
        live.step(1)
        assert not live.notes
        assert simulation.read("a.GoTo.speed")[0].tolist() == [[10, 30, 10], [10, 10, 10]]
        assert simulation.read("b.GoTo.speed")[0].tolist() == [[30, 10, 10], [10, 10, 10]]
        live.step(20)
        there = simulation.state_hash()
        live.seek(0.3)
        live.step(23)
        assert simulation.state_hash() == there
        recorder.flush()
        inputs = load_inputs(tmp_path / "run")
    assert [(each.step, each.name) for each in inputs] == [(5, "a.GoTo.speed"), (5, "b.GoTo.speed")]
    with Simulation(fleet(), 1) as again:
        again.play_inputs(inputs)
        again.step(26)
        assert again.state_hash() == there


@pytest.mark.parametrize(
    ("ids", "path", "value", "note"),
    [
        ([1, 99], "GoTo.speed", 3, "GoTo.speed: world 0 has no entity 99 now"),
        (
            [1],
            "GoTo.speeed",
            3,
            "a has no parameter 'GoTo.speeed' that can be set (did you mean 'GoTo.speed'?)",
        ),
        ([1], "GoTo.waypoints", [1, 2, 3], "a has no parameter 'GoTo.waypoints' that can be set"),
        ([1], "GoTo.speed", -3, "a: GoTo.speed = -3.0 is not allowed; it takes a finite number"),
        ([1], "GoTo.speed", "fast", "a.GoTo.speed: it takes a number"),
        ([1], "GoTo.tolerance_in_2d", 1, "a.GoTo.tolerance_in_2d: it takes true or false"),
        ([1], "GoTo.current", 1, "a has no parameter 'GoTo.current' that can be set"),
    ],
)
def test_a_parameter_that_cannot_be_set_is_told_and_changes_nothing(ids, path, value, note):
    with Simulation(fleet(), 1) as simulation, Live(simulation, threaded=False, is_paused=True) as live:
        live.step(2)
        before = simulation.state_hash()
        live.set_parameter(ids, path, value)
        assert len(live.notes) == 1
        assert live.notes[0].startswith(note)
        assert (live.injections, simulation.state_hash()) == ([], before)


def test_a_list_of_waypoints_is_followed_by_those_who_got_it():
    fleet = Block(
        name="fleet", count=2, autonomy=(WaypointDispatcher(lead_distance=500.0), GoTo(speed=20.0)), variance=(4, 4, 0),
        motion=SingleIntegrator(max_speed=20.0),
    )  # fmt: skip
    with (
        Simulation(Mission(blocks=[fleet], end=60.0, dt=0.1), 1) as simulation,
        Live(simulation, threaded=False, is_paused=True) as live,
    ):
        points = [[100, 0, 0, 0, 0, 0, 5, 0], [100, 60, 0, 0, 0, 0, 5, 0]]
        live.order([2], "GlobalNetwork", "WaypointList", {"points": points, "mode": 0})
        live.step(200)
        assert not live.notes
        pos = live.frame().pos[np.argsort(live.frame().id)]
        assert np.linalg.norm(pos[1] - (100, 60, 0)) < 6.0
        assert np.linalg.norm(pos[0]) < 10.0
        with pytest.raises(
            ParameterError, match=r"there is no topic GlobalNetwork/WaypointLists \(did you mean"
        ):
            live.order([2], "GlobalNetwork", "WaypointLists", {})


def test_entities_are_added_where_an_operator_says_and_that_is_part_of_the_game(tmp_path):
    blocks = [fleet().blocks[0], fleet().blocks[1].replace(heading=1.0, speed=7.0)]
    mission = fleet().replace(blocks=blocks)
    with (
        Simulation(mission, [1, 2]) as simulation, Recorder(simulation, tmp_path / "run") as recorder,
        Live(simulation, threaded=False, is_paused=True) as live,
    ):  # fmt: skip
        live.step(5)
        live.spawn("b", (30, 40, 5))
        live.spawn("a", [-30, 40, 5])
        live.step(2)
        assert not live.notes
        frame = live.frame()
        assert frame.id.tolist() == [1, 2, 3, 4, 5, 6, 7, 8]
        assert sorted(frame.block[-2:].tolist()) == [0, 1]
        assert (simulation.state.population.bodies.world == 1).sum() == 6
        new = frame.block.tolist().index(1, 6)
        assert np.allclose(frame.pos[new], (30, 40, 5), atol=6.0)
        # They take orders as the others do.
        live.set_parameter([int(frame.id[new])], "GoTo.speed", 30)
        live.step(20)
        there = simulation.state_hash()
        live.seek(0.3)
        live.step(24)
        assert simulation.state_hash() == there
        recorder.flush()
        inputs = load_inputs(tmp_path / "run")
    first = inputs[0]
    assert (first.step, first.name, first.values["block"], first.values["pos"]) == (
        5,
        "SpawnEntity",
        "b",
        [30, 40, 5],
    )
    assert np.allclose(first.values["vel"], (7 * np.cos(1.0), 7 * np.sin(1.0), 0))
    for seeds, world in (([1], 0), ([8, 1, 3], 1)):
        with Simulation(mission, seeds) as again:
            again.play_inputs(inputs, world)
            again.step(27)
            assert again.state_hash(world) == there


def test_an_entity_that_cannot_be_added_is_told_and_changes_nothing():
    mission = fleet(1).replace(limits=Limits(rows=4))
    with Simulation(mission, 1) as simulation, Live(simulation, threaded=False, is_paused=True) as live:
        live.step(2)
        with pytest.raises(
            ParameterError, match=r"position = \(1, 2\) is not allowed; it takes x, y, z in m"
        ):
            live.spawn("a", (1, 2))
        live.spawn("aa", (1, 2, 3))
        assert live.notes[0].startswith("spawn: there is no block 'aa' (did you mean 'a'?)")
        live.spawn("a", (1, 2, 3))
        live.spawn("b", (1, 2, 3))
        live.spawn("a", (9, 2, 3))
        assert len(live.injections) == 2
        live.step(1)
        live.spawn("a", (9, 2, 3))
        live.step(3)
        live.spawn("a", (9, 2, 3))
        assert len(live.injections) == 2
        assert len(live.frame().id) == 4
        assert live.notes[-1].startswith("spawn: world 0 has its most entities")


def test_an_entity_is_not_added_where_an_interaction_rejects_it():
    """As at the start of a game: in a wall, near another entity."""
    wall = Cuboid((50.0, 0.0, 0.0), (20.0, 20.0, 20.0))
    mission = fleet(1).replace(
        scene=Scene(walls=(wall,)),
        interactions=(SceneCollision(), SimpleCollision(startup_collision_range=5.0)),
    )
    with (
        Simulation(mission, [1, 2]) as simulation,
        Live(simulation, 1, threaded=False, is_paused=True) as live,
    ):
        live.spawn("a", (50, 3, 0))
        assert live.notes[-1] == "spawn: no entity can be at 50 3 0 m: SceneCollision rejects the position"
        live.spawn("a", live.frame().pos[0] + (1.0, 0.0, 0.0))
        assert live.notes[-1].endswith(": SimpleCollision rejects the position")
        assert not live.injections
        live.spawn("a", (50, 30, 0))
        live.step(2)
        assert len(live.frame().id) == 3
