"""Declarations, and plugins as data."""

from __future__ import annotations

import math
import pickle

import numpy as np
import pytest
from small_worlds import Delivery, Note

from tussle.api import (
    Autonomy,
    Children,
    EntityRef,
    Field,
    Handle,
    Input,
    Message,
    Messages,
    Output,
    Param,
    Publish,
    RaggedColumn,
    State,
)
from tussle.errors import DeclarationError, ParameterError, UnitError
from tussle.messages import EntityCaptured
from tussle.stock import MotorSchemas, MoveToGoalMS


class Sample(Autonomy):
    """All sorts of parameters."""

    speed = Param(20.0, unit="m/s", ge=0.0, lt=100.0)
    count = Param(3, gt=0, le=9)
    is_on = Param(True)
    mode = Param("fast", choices=("fast", "slow"))
    gains = Param((1.0, 0.5), fields="kp band", unit="1/s rad", text_unit="1/s deg")
    depth = Param(1.0, structural=True)
    path = Param([(0.0, 0.0)], fields="x y", unit="m", ragged=True)
    weights = Param([1.0], ragged=True)
    places = State("x y", unit="m")
    target = EntityRef()


# -- values -----------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "given", "value"),
    [
        ("speed", 5, 5.0),
        ("speed", "36 km/h", 10.0),
        ("speed", np.float32(2.5), 2.5),
        ("count", 4.0, 4),
        ("count", "7", 7),
        ("is_on", "false", False),
        ("is_on", 1, True),
        ("is_on", np.False_, False),
        ("mode", "slow", "slow"),
        ("gains", (2, "180 deg"), (2.0, math.pi)),
        ("gains", "2, 90 deg", (2.0, math.pi / 2)),
        ("path", [(1, 2), ("3 km", 4)], ((1.0, 2.0), (3000.0, 4.0))),
        ("weights", [1, 2, 3], (1.0, 2.0, 3.0)),
    ],
)
def test_values_are_taken_in_si(name, given, value):
    found = Sample(**{name: given}).values[name]
    assert found == pytest.approx(value) if name == "gains" else found == value
    assert type(found) is type(value)


@pytest.mark.parametrize(
    ("name", "given", "message"),
    [
        ("speed", -1, r"^Sample.speed = -1 is not allowed; it takes a finite number in m/s >= 0 and < 100"),
        ("speed", 100.0, r"Sample.speed = 100.0 is not allowed"),
        ("speed", math.nan, r"Sample.speed = nan is not allowed"),
        ("speed", True, r"Sample.speed = True is not allowed"),
        ("speed", None, r"Sample.speed = None is not allowed"),
        ("speed", "fast", r"Sample.speed = 'fast'"),
        ("speed", "3 kg", r"Sample.speed = '3 kg': .*kg"),
        ("speed", "3 m/ss", r"Sample.speed = '3 m/ss': 'ss' is not a unit"),
        ("speed", [1.0], r"Sample.speed = \[1.0\] is not allowed"),
        ("count", 0, r"Sample.count = 0 is not allowed; it takes a whole number > 0 and <= 9"),
        ("count", 2.5, r"Sample.count = 2.5 is not allowed"),
        ("count", math.nan, r"Sample.count = nan is not allowed"),
        ("count", math.inf, r"Sample.count = inf is not allowed"),
        ("speed", 10**400, r"Sample.speed = 10{400} is not allowed; .* of at most 1e\+30"),
        ("speed", np.float64(1e300), r"Sample.speed = 1e\+300 is not allowed"),
        ("count", np.int64(10), r"Sample.count = 10 is not allowed"),
        ("count", -(10**400), r"Sample.count = -10{400} is not allowed"),
        ("is_on", 2, r"Sample.is_on = 2 is not allowed; it takes true or false"),
        ("is_on", "maybe", r"Sample.is_on = 'maybe' is not allowed"),
        ("mode", "quick", r"Sample.mode = 'quick' is not allowed; it takes one of 'fast', 'slow'"),
        ("mode", 3, r"Sample.mode = 3 is not allowed"),
        ("gains", (1,), r"Sample.gains = \(1,\) is not allowed; it takes 2 values \(kp, band\)"),
        ("gains", 5, r"Sample.gains = 5 is not allowed; it takes 2 values \(kp, band\)"),
        ("gains", (1, "x"), r"Sample.gains = 'x'"),
        ("path", 5, r"Sample.path = 5 is not allowed; it takes a list"),
        ("path", [5], r"Sample.path = 5 is not allowed; it takes 2 values \(x, y\)"),
        ("weights", 5, r"Sample.weights = 5 is not allowed; it takes a list"),
        ("sped", 5, r"Sample has no parameter 'sped' \(did you mean 'speed'\?\)"),
        ("rate", 0, r"Sample: rate = 0 is not allowed; it takes a finite number in 1/s > 0"),
        ("rate", math.nan, r"Sample: rate = nan"),
        ("rate", math.inf, r"Sample: rate = inf"),
        ("rate", "often", r"Sample: rate = 'often'"),
    ],
)
def test_values_that_are_refused(name, given, message):
    with pytest.raises(ParameterError, match=message):
        Sample(**{name: given})


def test_units_are_of_the_same_tree():
    with pytest.raises(ParameterError):
        Sample(speed="3 furlong/fortnigt")
    assert issubclass(UnitError, ParameterError)


# -- plugins as data --------------------------------------------------------------------------------------------------------------


def test_plugins_compare_by_value_pickle_and_say_what_differs():
    one = Sample(speed=5, path=[(1, 2)], name="mine", rate=2.0)
    assert one == Sample(speed=5.0, path=((1.0, 2.0),), name="mine", rate=2.0)
    assert one != Sample(speed=5)
    assert hash(one) == hash(pickle.loads(pickle.dumps(one)))
    assert pickle.loads(pickle.dumps(one)) == one
    assert repr(one) == "Sample(speed=5.0, path=((1.0, 2.0),), name='mine', rate=2.0)"
    assert repr(Sample()) == "Sample()"
    assert one.replace(speed=7).values["speed"] == 7.0
    assert one.replace(speed=7).instance_name == "mine"
    assert Sample() != MoveToGoalMS()


def test_nested_plugins_too():
    nest = MotorSchemas(behaviors=[MoveToGoalMS(goal=(1, 2, 3))])
    assert nest == pickle.loads(pickle.dumps(nest))
    assert repr(nest) == "MotorSchemas(behaviors=[MoveToGoalMS(goal=(1.0, 2.0, 3.0))])"


def test_the_signature_shows_names_and_defaults():
    import inspect

    parameters = inspect.signature(Sample).parameters
    assert parameters["speed"].default == 20.0
    assert list(parameters)[-3:] == ["name", "rate", "states"]


def test_a_plugin_is_a_value_and_has_no_arrays():
    one = Sample()
    with pytest.raises(ParameterError, match=r"Sample.speed cannot be changed"):
        one.speed = 3.0
    with pytest.raises(AttributeError, match=r"Sample.wings is not declared"):
        one.wings = 3.0
    with pytest.raises(AttributeError, match=r"Sample.places is an array only inside a simulation"):
        _ = one.places
    assert one.speed == 20.0
    assert isinstance(Sample.speed, Param)


# -- declarations -----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: State("x-y z"), r"State: 'x-y' is not a valid name"),
        (lambda: Param((1.0, 2.0), fields="a a"), r"Param: duplicate name in 'a a'"),
        (lambda: State(dtype=complex), r"State: dtype <class 'complex'> is not one of float, int, bool"),
        (lambda: State(per="block"), r"State: per='block' is not one of entity, world, team"),
        (lambda: type("A", (Autonomy,), {"grade": "perfect"}), r"A.grade is 'perfect'; .* portable"),
        (lambda: type("A", (Autonomy,), {"name": State()}), r"A.name: the name is reserved"),
        (lambda: type("A", (Autonomy,), {"_x": Param(1.0)}), r"A._x: the name is reserved"),
        (lambda: type("M", (Message,), {"x": State()}), r"M.x: a message field is a Field"),
        *(
            (
                lambda name=name: type("M", (Message,), {name: Field()}),
                rf"M.{name}: .* reserved in messages, as are world, sender, ",
            )
            for name in ("world", "type", "data", "sender", *(k for k in dir(Messages) if k[0] != "_"))
        ),
        (
            lambda: type("M", (Message,), {"a": Field(ragged=True), "b": Field(ragged=True)}),
            r"M has more than one ragged field",
        ),
    ],
)
def test_unsound_declarations_are_refused_where_they_stand(make, message):
    with pytest.raises(DeclarationError, match=message):
        make()


def test_a_default_out_of_its_own_bounds_is_refused():
    with pytest.raises(ParameterError, match=r"Param = -1.0 is not allowed"):
        Param(-1.0, ge=0.0)


def test_units_of_declarations_are_known():
    with pytest.raises((UnitError, DeclarationError), match="parsec"):
        State(unit="parsec")
    with pytest.raises((UnitError, DeclarationError, ValueError), match="m s"):
        Param((1.0, 2.0, 3.0), fields="a b c", unit="m s")


def test_declarations_are_inherited_and_compare():
    class Faster(Sample):
        speed = Param(50.0, unit="m/s")
        extra = Output(unit="m")

    assert list(Faster.params()) == list(Sample.params())
    assert Faster().values["speed"] == 50.0
    assert list(Faster.outputs()) == ["extra"]
    assert State("x", unit="m") == State("x", unit="m")
    assert State("x", unit="m") != State("x", unit="s")
    assert Input("speed").channels == ("speed",)
    assert Sample.children() == {}
    assert isinstance(Children(Autonomy), Children)
    assert Publish(Note).topic == "Note"
    assert Handle(doc="x").doc == "x"


# -- ragged columns and batches -----------------------------------------------------------------------------------------------------


def test_ragged_columns():
    column = RaggedColumn.from_rows([[(1, 3), (2, 4)], [], [(5,), (6,)]], Field("x y", ragged=True))
    assert len(column) == 3
    assert column[0].tolist() == [[1.0, 3.0], [2.0, 4.0]]
    assert column[1].shape == (2, 0)
    taken = column.take(np.array([2, -1, 0]))
    assert taken.start.tolist() == [0, 1, 1, 3]
    assert taken.data.tolist() == [[5.0, 1.0, 3.0], [6.0, 2.0, 4.0]]
    assert RaggedColumn.empty(0, Field(ragged=True)).take(np.array([-1, -1])).start.tolist() == [0, 0, 0]
    with pytest.raises(ValueError, match=r"shape \(2,\) and data \(2, 3\)"):
        column.set([0, 3], np.zeros((2, 3)))
    with pytest.raises(ValueError, match="start must rise from 0 to the number of items, 3"):
        column.set([0, 2, 1, 3], np.zeros((2, 3)))


def test_batches_of_messages():
    one = Messages.make(Note, np.array([1, 0]), np.array([7, 3]), {"value": [10, 20]})
    two = Messages.make(Note, np.array([0]), np.array([1]), {"value": 30})
    both = Messages.concatenate([one, two])
    assert both.world.tolist() == [0, 0, 1]
    assert both.sender.tolist() == [1, 3, 7]
    assert both.value.tolist() == [30, 20, 10]
    assert len(Messages.empty(Note)) == 0
    with pytest.raises(
        AttributeError, match=r"messages of this type have no field 'valu' \(did you mean 'value'\?\)"
    ):
        _ = both.valu
    with pytest.raises(ParameterError, match=r"Note.value: shape \(3,\) does not fit \(2,\)"):
        Messages.make(Note, np.zeros(2, int), np.zeros(2, int), {"value": [1, 2, 3]})
    one = np.zeros(1, int)
    for points, text in (
        ([[1, 2]], r".*row 0 has shape \(2,\); expected \(2, m\)"),
        ([(1, 2), (3, 4)], r"expected an array \(2, m\) for all messages, or a list of 1"),
        (
            RaggedColumn.empty(2, Delivery.fields["points"]),
            r"2 lists with items of shape \(2,\); expected 1 lists with items of shape \(2,\)",
        ),
    ):
        with pytest.raises(ParameterError, match=f"Delivery.points: {text}"):
            Messages.make(Delivery, one, one, {"points": points})
    with pytest.raises(ParameterError, match=r"Delivery.thing: 3 objects"):
        Messages.make(Delivery, np.zeros(2, int), np.zeros(2, int), {"thing": ["a", "b", "c"]})
    captured = Messages.make(EntityCaptured, np.zeros(2, int), np.zeros(2, int), {"source": [1, 2]})
    assert captured.source_team.tolist() == [0, 0]


def test_messages_keep_the_order_of_saying():
    first = Messages.make(Note, np.zeros(2, int), np.array([5, 5]), {"value": [1, 2]})
    second = Messages.make(Note, np.zeros(1, int), np.array([5]), {"value": 3})
    assert Messages.concatenate([first, second]).value.tolist() == [1, 2, 3]
    assert Messages.concatenate([second, first]).value.tolist() == [3, 1, 2]


@pytest.mark.parametrize("unit", ["deg", "kt", "m deg"])
def test_a_unit_that_is_not_si_is_refused(unit):
    with pytest.raises(DeclarationError, match=r"is not an SI unit"):
        Param((0.0, 0.0) if " " in unit else 0.0, unit=unit, fields="a b" if " " in unit else "")
