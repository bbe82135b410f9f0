"""Declarations and arguments of views that cannot be are refused by name; none is taken for something else."""

import inspect
import math
import re
from contextlib import suppress
from functools import partial

import numpy as np
import pytest
from small_worlds import block, mission

from tussle import Simulation, load_run
from tussle.api import (
    Autonomy,
    EasyAutonomy,
    EasyInteraction,
    Input,
    Interaction,
    Metric,
    Output,
    Param,
    Publish,
    State,
    Subscribe,
    neighbors,
)  # fmt: skip
from tussle.errors import DeclarationError, ParameterError, PluginError, TussleError
from tussle.plan import Problem, solve
from tussle.stock import Still, Unicycle


@pytest.mark.parametrize(
    ("declare", "text"),
    [
        (lambda: State("x y", default=(1, 2, 3)), r"State: default = \(1, 2, 3\) is not allowed; it takes a number, or 2 \(x, y\)"),
        (lambda: State("x y", default=(1,)), r"default = \(1,\) is not allowed"),
        (lambda: State(default=(1, 2)), r"default = \(1, 2\) is not allowed; it takes a number$"),
        (lambda: State(default="x"), "default = 'x' is not allowed; it takes a number"),
        (lambda: State(default=None), "default = None is not allowed"),
        (lambda: State(dtype=int, default=1.5), "default = 1.5 is not allowed; it takes a whole number of 64 bits"),
        (lambda: State(dtype=int, default=2**63), "it takes a whole number of 64 bits"),
        (lambda: State(dtype=int, default=math.nan), "default = nan is not allowed; it takes a whole number"),
        (lambda: State(dtype=bool, default=2), "default = 2 is not allowed; it takes true or false"),
        (lambda: State("x y", dtype=int, default=(1, 0.5)), r"it takes a whole number of 64 bits, or 2 \(x, y\)"),
        (lambda: Input("u v", optional=True, default=(1, 2, 3)), r"Input: default = \(1, 2, 3\) is not allowed"),
        (lambda: State(unit=5), "State: unit = 5 is not allowed; it takes a text"),
        (lambda: Output(dtype=int), r"Output: got an unexpected keyword argument 'dtype'.*; there are: channels, unit, ragged"),
        (lambda: Input(chanels="a"), r"Input: .*'chanels' \(did you mean 'channels'\?\)"),
        (Param, "Param: missing a required argument: 'default'"),
        (lambda: Param(1, choices=5), "Param: choices = 5 is not allowed; it takes a list"),
        (lambda: State("a b", per="team"), "fields='a b' with per='team', which has one number per team"),
        (lambda: State(5), "State: names = 5 is not allowed; it takes a text"),
        (lambda: Publish(3), "Publish: 3 is not a class of messages"),
        (lambda: Subscribe(Autonomy), "Subscribe: <class .*Autonomy'> is not a class of messages"),
        *(
            (lambda name=name: type("Own", (Autonomy,), {name: State()}), f"Own.{name}: the name is reserved")
            for name in ("columns", "services", "wired", "values", "kind", "rate")
        ),
        (lambda: type("Own", (Autonomy,), {"n": State(per="world")}), "Own.n: a column per world belongs to an interaction"),
        (lambda: type("Own", (Autonomy,), {"n": State(per="team")}), "Own.n: a column per team belongs"),
    ],
)  # fmt: skip
def test_declarations_that_cannot_be(declare, text):
    with pytest.raises(DeclarationError, match=text):
        declare()


def test_defaults_are_those_of_their_columns():
    class Own(Metric):
        pair = State("a b", default=[1.5, math.nan], per="world")
        one = State(default=7, per="world")
        marks = State("c d", dtype=bool, default=(True, 0), per="world")
        count = State(dtype=int, default=3.0, per="world")

    with Simulation(mission(block("a", team=1), metrics=[Own()]), seeds=[1, 2]) as simulation:
        simulation.step()
        simulation.reset([1])
        found = {name: simulation.read(f"Own.{name}")[0].tolist() for name in ("one", "marks", "count")}
        assert found == {"one": [7.0] * 2, "marks": [[True, False]] * 2, "count": [3] * 2}
        np.testing.assert_array_equal(simulation.read("Own.pair")[0], [[1.5, math.nan]] * 2)


class Parent(Autonomy):
    """A plugin that others inherit from."""

    top = Param(3.0)
    memory = State()
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")


def nothing(self, g):
    """Do nothing."""


async def later(self, g):
    """Do nothing, later."""


async def later_and_later(self, g):
    """Do nothing, again and again."""
    yield


def piece_by_piece(self, g):
    """Do nothing by and by."""
    yield


NO_CALL = "a call does nothing"
OVERRIDES = {
    "a number in place of a parameter": ({"top": 4.0}, r"Own.top = 4.0 hides the Param of Parent; .* top = Param\(4.0, ...\)"),
    "None in place of a parameter": ({"top": None}, "Own.top = None hides the Param of Parent"),
    "a method in place of a state": ({"memory": nothing}, "Own.memory = .* hides the State of Parent; choose another name"),
    "a property in place of an output": ({"velocity": property(len)}, "Own.velocity = .* hides the Output of Parent"),
    "a method without g": ({"step": lambda self: None}, r"test_what_.*py:\d+: <lambda> takes \(self\); it is called with \(self, g\)"),
    "a method with too much": ({"spawn": nothing}, r"nothing takes \(self, g\); it is called with \(self, g, rows\)"),
    "a coroutine": ({"step": later}, f"later: with `async def` {NO_CALL}"),
    "an asynchronous generator": ({"step": later_and_later}, f"later_and_later: with `async def` {NO_CALL}"),
    "a generator": ({"step": piece_by_piece}, f"piece_by_piece: with `yield` {NO_CALL}"),
    **{
        f"a column called {name}": ({name: Param(1.0)}, f"Own.{name}: .* choose another name for this Param")
        for name in dir(Autonomy)
        if not name.startswith("__") and name not in ("grade", "kind")
    },
}  # fmt: skip


@pytest.mark.parametrize("name", OVERRIDES)
def test_what_a_class_may_not_write_over(name):
    own, text = OVERRIDES[name]
    with pytest.raises(DeclarationError, match=text):
        type("Own", (Parent,), own)


@pytest.mark.parametrize(
    "own",
    [
        {"top": Param(4.0)},
        {"step": lambda self, view: None},
        {"step": lambda self, g, memo=None: None},
        {"step": lambda self, *views: None},
        {"replace": lambda self, **values: self},
        {"named_regions": lambda self: iter(())},
        {"helper": later},
    ],
)
def test_what_a_class_may_write_over(own):
    assert type("Own", (Parent,), own)().values["top"] == getattr(own.get("top"), "default", 3.0)


@pytest.mark.parametrize("radius", [-1.0, math.nan, None, True, (30.0,), "number", "whole"])
def test_the_radius_of_a_law_is_a_real_number(radius):
    def alone(distance):
        return distance

    own = {
        "number": Param(True),
        "whole": Param(3),
        "near": neighbors(radius, n="count")(staticmethod(alone)),
    }
    with pytest.raises(
        DeclarationError, match=r"Own.near: the radius .* is not allowed; it takes a real number >= 0"
    ):
        type("Own", (Autonomy,), own)


def looks(look):
    """An interaction that does this in its step, with 5 rows."""

    def step(self, w):
        look(w)

    with Simulation(
        mission(block("a", team=1, count=5), interactions=[type("Looks", (Interaction,), {"step": step})()])
    ) as made:
        made.step()


@pytest.mark.parametrize(
    ("look", "text"),
    [
        *(
            (lambda w, radius=radius: w.near(radius), "near: radius = .* is not allowed; it takes a number, or numbers")
            for radius in (
                math.nan, None, "30 m", True, np.ones(3), np.ones((5, 1)), np.ones(5, bool), np.array([1, np.nan, 1, 1, 1.0]),
            )
        ),
        *(
            (lambda w, k=k: w.nearest(k), "nearest: k = .* is not allowed; it takes a whole number >= 1")
            for k in (0, -1, 1.5, "2", True)
        ),
        (lambda w: w.uniform(5), "uniform: label = 5 is not allowed; it takes a text"),
        (lambda w: w.uniform(), "uniform: missing a required argument: 'label'; there are: label, k"),
        (lambda w: w.region("a"), "region: boundary = 'a' is not allowed; it takes a number"),
        (lambda w: w.who(5), "who: row = 5 is not allowed; it takes a whole number from 0 to 4"),
        (lambda w: w.nearest(teams=np.ones(3)), r"nearest: teams = an array \(3,\) is not allowed; it takes \(5,\)"),
        *(
            (lambda w, ids=ids: w.rows_of(ids), r"ids = an array of .* is not allowed; it takes whole numbers, \(5,\)")
            for ids in ([1], list(range(9)), [1.5] * 5, 3, ["a"] * 5, np.ones((5, 1), int))
        ),
        (lambda w: w.rows_at([0, 0], [1]), r"ids = an array of int64, \(1,\) is not allowed; it takes whole numbers, \(2,\)"),
        (lambda w: w.move([0], pos=1.0), r"w.move: pos has shape \(\); it takes \(3, 1\)"),
        (lambda w: w.move([0], pos="east"), "w.move: pos = 'east' is not allowed; it takes numbers"),
        (lambda w: w.move([0], vel=[None, 1, 2]), r"w.move: vel = \[None, 1, 2\] is not allowed; it takes numbers"),
        (lambda w: w.move([0], vel=[[1], [2, 3], [4]]), "w.move: vel = .* is not allowed; it takes numbers"),
        (lambda w: w.uniform_by("a", [0.5], [1], [2]), "worlds of the draw 'a' = .* is not allowed; it takes whole numbers from 0 to 0"),
        (lambda w: w.uniform_by("a", [5], [1], [2]), "worlds of the draw 'a' = 5 is not allowed; it takes whole numbers from 0 to 0"),
        (lambda w: w.normal_by("a", [-1], [1], [2]), "worlds of the draw 'a' = -1 is not allowed; it takes whole numbers from 0 to 0"),
        (lambda w: w.normal_by("a", 0, "x", 2), "numbers of the draw 'a' = 'x' is not allowed; it takes whole numbers"),
        (lambda w: w.inbox(int), "w.inbox: <class 'int'> is not allowed; it takes a message type"),
        (lambda w: w.rows_at([1], [1]), "rows_at: world = 1 is not allowed; it takes whole numbers from 0 to 0"),
    ],
)  # fmt: skip
def test_arguments_of_views_that_cannot_be(look, text):
    with pytest.raises(PluginError, match=text):
        looks(look)


@pytest.mark.parametrize(
    "radius", [30, np.float32(30), np.int64(30), [30.0] * 5, np.full(5, 30), np.full(5, 30, np.float32)]
)
def test_a_radius_of_any_type_is_that_number(radius):
    def look(w):
        np.testing.assert_array_equal(w.near(radius).distance, w.near(30.0).distance)
        assert w.rows_of([1, 2, 3, 4, 5]).tolist() == [0, 1, 2, 3, 4]

    looks(look)


def test_the_default_of_an_input_has_a_number_for_each_channel():
    class Reads(Autonomy):
        two = Input("east north", unit="m", optional=True, default=(3.0, 4.0))
        one = Input("up", unit="m", optional=True, default=5.0)
        seen = State("a b c")

        def step(self, g):
            self.seen[:] = *self.two, *self.one

    with Simulation(mission(block("a", team=1, autonomy=Reads(), motion=Still()))) as simulation:
        simulation.step()
        assert simulation.read("a.Reads.seen")[0].ravel().tolist() == [3.0, 4.0, 5.0]


def wrong_calls(view):
    """Call each method of a view with objects for the arguments that it needs, and for each other one. Yields the name and the call."""
    for name, method in inspect.getmembers(type(view), inspect.isfunction):
        given = [p for p in inspect.signature(method).parameters.values() if p.name != "self"]
        given = [p for p in given if p.kind not in (p.VAR_POSITIONAL, p.VAR_KEYWORD)]
        for which in (
            given if not name.startswith("_") and name not in ("begin", "step") else ()
        ):  # of the engine
            chosen = [p for p in given if p is which or p.default is p.empty]
            args = [object() for p in chosen if p.kind is p.POSITIONAL_ONLY]
            kwargs = {p.name: object() for p in chosen if p.kind is not p.POSITIONAL_ONLY}
            yield f"{name}: {which.name}", partial(getattr(view, name), *args, **kwargs)


def check_wrong_calls(self, view):
    for name, call in wrong_calls(view):
        try:
            call()
        except TussleError:
            continue
        raise AssertionError(f"{type(view).__name__}.{name} takes any object")


@pytest.mark.parametrize("base", [Autonomy, EasyAutonomy, Interaction, EasyInteraction])
def test_an_argument_of_another_type_is_never_an_error_of_python(base):
    own = type(
        "Own", (base,), {"step_one" if base in (EasyAutonomy, EasyInteraction) else "step": check_wrong_calls}
    )()
    is_autonomy = issubclass(base, Autonomy)
    plugins = {"interactions": [] if is_autonomy else [own]}
    with Simulation(
        mission(block("a", team=1, count=2, autonomy=own if is_autonomy else (), motion=Still()), **plugins)
    ) as simulation:
        simulation.step()
        scene = simulation.mission.scene
    for _, call in wrong_calls(scene):
        with suppress(TussleError):  # `bases_of` takes any
            call()


def test_a_function_names_the_argument_of_another_type():
    made = Simulation(mission(block("a")))
    gap = {"motion": Unicycle(), "start": {}, "goal": (9.0, 0, 0), "goal_radius": 1.0, "bounds": {"x": (0, 9), "y": (0, 9)},
           "commands": {"speed": (0, 1)}}  # fmt: skip
    calls = {
        "path = 5 is not allowed; it takes a text or a Path": lambda: load_run(5),
        "call = 3 is not allowed; it takes a function": lambda: made.schedule.insert(before="motion", call=3),
        "before = 3 is not allowed; it takes a text or None": lambda: made.schedule.insert(
            before=3, call=print
        ),
        "problem = None is not allowed; it takes a Problem": lambda: solve(None),
        "cells = [1] is not allowed; it takes values by name or None": lambda: solve(
            Problem(**gap), cells=[1]
        ),
        "motion = None is not allowed; it takes a MotionModel": lambda: Problem(**{**gap, "motion": None}),
        "start = [1] is not allowed; it takes values by name": lambda: Problem(**{**gap, "start": [1]}),
        "bounds = [1] is not allowed; it takes values by name": lambda: Problem(**{**gap, "bounds": [1]}),
        "scene = None is not allowed; it takes a Scene": lambda: Problem(**{**gap, "scene": None}),
    }
    for text, call in calls.items():
        with pytest.raises(ParameterError, match=re.escape(text)):
            call()
    made.close()
