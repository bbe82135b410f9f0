"""What varies, as text and as values."""

import json
import math
import re

import numpy as np
import pytest

from tussle.batch.points import settings_of, variables_of
from tussle.batch.variables import Choice, Range, parse_variable
from tussle.errors import ParameterError, UnitError
from tussle.mission import read_mission


@pytest.mark.parametrize(
    ("text", "variable"),
    [
        ("prey_speed=20:30", Range("prey_speed", 20, 30, is_text=True)),
        ("prey_speed=20:30 kt", Range("prey_speed", 20, 30, unit="kt", is_text=True)),
        (" prey_speed = 20 kt : 30 kt ", Range("prey_speed", 20, 30, unit="kt", is_text=True)),
        ("a.turn=-1:1 rad/s:log", "a low bound > 0"),
        ("prey.count=50:100:int", Range("prey.count", 50, 100, is_int=True, is_text=True)),
        ("prey.Boids.gain=1e-3:10:log", Range("prey.Boids.gain", 0.001, 10, is_log=True, is_text=True)),
        ("n=1:100:int:log", Range("n", 1, 100, is_int=True, is_log=True, is_text=True)),
        ("n=1:100:log:int", Range("n", 1, 100, is_int=True, is_log=True, is_text=True)),
        ("x=0:1:5", Range("x", 0, 1, levels=5, is_text=True)),
        ("x=0:10:int:5", Range("x", 0, 10, is_int=True, levels=5, is_text=True)),
        ("x=0:10:5:int", Range("x", 0, 10, is_int=True, levels=5, is_text=True)),
        ("x=-20:-10 m:3", Range("x", -20, -10, levels=3, unit="m", is_text=True)),
        ("x=10:30:3 km/h", Range("x", 10, 30, levels=3, unit="km/h", is_text=True)),
        ("x=10:30:int kt", Range("x", 10, 30, is_int=True, unit="kt", is_text=True)),
        ("x=1:9:log: 5  m ", Range("x", 1, 9, is_log=True, levels=5, unit="m", is_text=True)),
        ("tactic=keep,switch", Choice("tactic", ("keep", "switch"), is_text=True)),
        ("tactic = keep , switch ", Choice("tactic", ("keep", "switch"), is_text=True)),
        ("prey.count=50,100,200", Choice("prey.count", (50, 100, 200), is_text=True)),
        ("x=-1.5,+2,1e3", Choice("x", (-1.5, 2, 1000.0), is_text=True)),
        ("x=20 kt,30 kt", Choice("x", ("20 kt", "30 kt"), is_text=True)),
        ("x=true,false", Choice("x", ("true", "false"), is_text=True)),
        ("x=inf,1_0,0x1", Choice("x", ("inf", "1_0", "0x1"), is_text=True)),
        ("x=3", Choice("x", (3,), is_text=True)),
        ("prey.motion_model=Unicycle vel_max='30',None", Choice("prey.motion_model", ("Unicycle vel_max='30'", "None"), is_text=True)),
        ("x=a=b,c", Choice("x", ("a=b", "c"), is_text=True)),
        ("clock=noon:sharp,dawn", Choice("clock", ("noon:sharp", "dawn"), is_text=True)),
    ],
)  # fmt: skip
def test_texts_of_the_command_line(text, variable):
    if isinstance(variable, str):
        with pytest.raises(ParameterError, match=variable):
            parse_variable(text)
        return
    found = parse_variable(text)
    assert found == variable
    if isinstance(found, Choice):
        assert [type(v) for v in found.values] == [type(v) for v in variable.values]


@pytest.mark.parametrize(
    "text",
    [
        "x", "=3", "x=", "x=a,,b", "x=30:20", "x=3:3 kt", "x=nan:3", "x=0:inf", "x=0:1e400", "x=a:3", "x=:3", "x=" + "9" * 300 + ":3",
        "x=0:3:log", "x=0:2.5:int", "x=0:1e17:int", "x=0:1:1", "x=0:1:-3", "x=0:1:2000000", "x=0:3:int:9", "x=1:9:int:log:9",
        "x=a,b,a", "x=1,1.0", "x=1,1e999", "x=0:1:lg", "x=0:1:0.1", "x=0:1:", "x=0:1:5:6", "x=0:1:int:int", "x=20 kt:30 m",
        "x=20 kt:30", "x=20:30,50",
        "x=20:30 kt:3 kt", "x=20:30 kt:3 m", "x=20 kt:30:3 m",
        "x=20:30:3 knots", "x=20:30:3 4", "x=20:30:3kt", "x=20:30:3 kt:int", "seed=1,2",
    ],
)  # fmt: skip
def test_a_malformed_text_is_refused_in_one_line_that_names_the_variable(text):
    with pytest.raises(ParameterError) as error:
        parse_variable(text)
    assert re.match(
        r"x: |'x' is no variable|a variable has a name, not ''|'seed' cannot vary", str(error.value)
    )
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 300


def test_units_are_those_of_tussle():
    with pytest.raises(UnitError, match=r"x: 'knots' is not a unit \(did you mean 'kt'\?\)"):
        parse_variable("x=20:30 knots")
    with pytest.raises(UnitError, match="x: 'furlong' is not a unit"):
        Range("x", 1, 2, unit="furlong")


@pytest.mark.parametrize(
    ("kind", "values"),
    [
        (Range, ("", 1, 2)), (Range, (3, 1, 2)), (Range, ("x", "1", 2)), (Range, ("x", 1, True)), (Range, ("x", 0, 1, False, False, 2.5)),
        (Choice, ("x", "abc")), (Choice, ("x", ())), (Choice, ("x", ([1, 2],))), (Choice, ("x", (None,))), (Choice, ("x", (math.nan,))),
        (Choice, ("x", (2**63,))), (Choice, ("x", (True, "true"))),
    ],
)  # fmt: skip
def test_variables_made_in_python_are_checked_as_well(kind, values):
    with pytest.raises(ParameterError, match=r"^(x: |a variable has a name)"):
        kind(*values)


def test_choices_that_only_look_alike_are_different():
    assert Choice("x", (1, "1", True)).n_values == 3


def test_values_of_numpy_become_plain():
    choice = Choice("x", np.linspace(0, 1, 3))
    ranged = Range("x", np.float32(1), np.int64(2), levels=np.int64(3))
    assert json.loads(json.dumps(choice.values)) == [0.0, 0.5, 1.0]
    assert json.dumps([ranged.low, ranged.high, ranged.levels]) == "[1.0, 2.0, 3]"


def test_values_as_texts_of_a_mission():
    assert Range("x", 0, 1).text(0.1) == "0.1"
    assert Range("x", 0, 1).text(np.float64(0.1)) == "0.1"
    assert Range("x", 0, 100, unit="kt").text(23.5) == "23.5 kt"
    assert Range("x", 0, 100, is_int=True).text(np.int64(7)) == "7"
    assert Range("x", 0, 100, is_int=True, unit="deg").text(7.0) == "7 deg"
    assert Range("x", 0, 100, unit="kt").text("12 m/s") == "12 m/s"
    choice = Choice("x", ("a", 1, 2.5, True, False))
    assert [choice.text(v) for v in choice.values] == ["a", "1", "2.5", "true", "false"]


def test_spread_values_reach_both_bounds():
    assert Range("x", 0, 1).spread(5) == (0.0, 0.25, 0.5, 0.75, 1.0)
    assert Range("x", 0, 0.3).spread(4) == (0.0, 0.1, 0.2, 0.3)
    assert Range("x", 1e-3, 10, is_log=True).spread(5) == (0.001, 0.01, 0.1, 1.0, 10.0)
    assert Range("x", 0, 10, is_int=True).spread(4) == (0, 3, 7, 10)
    assert Range("x", 10, 10000, is_int=True, is_log=True).spread(4) == (10, 100, 1000, 10000)
    assert all(type(v) is int for v in Range("x", 0, 10, is_int=True).spread(4))


def test_shares_of_whole_numbers_are_equal_and_hold_both_bounds():
    x = Range("x", 3, 6, is_int=True)
    shares = (np.arange(400) + 0.5) / 400
    counts = np.bincount([x.value_at(s) for s in shares.tolist()])
    assert counts.tolist() == [0, 0, 0, 100, 100, 100, 100]
    assert [x.value_at(0.0), x.value_at(1.0)] == [3, 6]


def test_levels_are_the_only_values_of_their_range():
    x = Range("x", 0, 1, levels=3)
    assert [x.value_at(s) for s in (0.0, 0.3, 0.34, 0.66, 0.67, 1.0)] == [0.0, 0.0, 0.5, 0.5, 1.0, 1.0]


def test_values_have_no_more_digits_than_the_width_of_the_range_bears():
    assert Range("x", 20, 30).value_at(1 / 3) == 23.3333333333
    narrow = Range("x", 35.721025, 35.721026)
    values = {narrow.value_at(s) for s in np.linspace(0, 1, 1001).tolist()}
    assert len(values) == 1001


def test_a_mission_reads_the_values_of_a_point():
    texts = ["prey=3:9:int", "keepers.Predator.max_speed=20:30 kt", "switchers.Predator.allow_prey_switching=true,false"]  # fmt: skip
    variables = [parse_variable(text) for text in texts]
    point = {
        "prey": 7,
        "keepers.Predator.max_speed": 25.0,
        "switchers.Predator.allow_prey_switching": "false",
    }
    texts = settings_of(point, variables)
    assert texts["keepers.Predator.max_speed"] == "25.0 kt"
    blocks = {b.name: b for b in read_mission("predator_prey", texts).mission.blocks}
    assert blocks["prey"].count == 7
    assert blocks["keepers"].autonomy[0].max_speed == pytest.approx(25 * 1852 / 3600)
    assert blocks["switchers"].autonomy[0].allow_prey_switching is False


def test_a_point_has_one_value_of_each_variable():
    variables = [Range("prey_speed", 1, 2), Choice("tactic", ("keep",))]
    with pytest.raises(
        ParameterError, match=r"'prey_sped', which does not vary \(did you mean 'prey_speed'\?\)"
    ):
        settings_of({"prey_sped": 1, "tactic": "keep"}, variables)
    with pytest.raises(ParameterError, match="the point has no value of tactic"):
        settings_of({"prey_speed": 1}, variables)


def test_points_that_are_given_tell_what_varies():
    points = [{"x": 1, "y": "a"}, {"x": 1.0, "y": "b"}, {"x": 2.5, "y": "a"}]
    assert variables_of(points) == [Choice("x", (1, 2.5)), Choice("y", ("a", "b"))]


@pytest.mark.parametrize(
    ("points", "said"),
    [
        ([], "there are no points"),
        ([{"x": 1}, {"x": 2, "y": 3}], "points 0 and 1 differ in 'y'"),
        ([{"x": 1, "y": 3}, {"x": 2}], "points 0 and 1 differ in 'y'"),
        ([{"x": [1]}], r"x: \[1\] cannot be chosen"),
    ],
)
def test_points_that_are_given_are_checked(points, said):
    with pytest.raises(ParameterError, match=said):
        variables_of(points)
