"""Specifications: how they are read, what they refuse, and what their signals are."""

from __future__ import annotations

import numpy as np
import pytest

from tussle import Simulation
from tussle.errors import ParameterError
from tussle.mission import read_mission
from tussle.stress import Monitor, Specification
from tussle.stress.formulas import Above, Every, UntilHolds, Window

MISSION = read_mission("predator_prey", {"prey": 12, "run.end": 20}).mission


def parse(text, mission=MISSION, **functions):
    return Specification.parse(text, mission, functions)


def test_windows_are_in_samples_and_units_are_converted():
    spec = parse("always[0, 10 s] (distance(team 1, team 2) > 2 ft) and eventually (count(team 1) < 3)")
    always, eventually = spec.formula.parts
    assert isinstance(always, Window)
    assert (always.first, always.last, eventually.last) == (0, round(10.0 / MISSION.dt), None)
    assert spec.terms["0"].right.value == pytest.approx(0.6096)


def test_precedence():
    formula = parse("max_speed(all) < 1 or time > 1 and time > 2 -> time > 3").formula
    assert isinstance(formula, Every)
    assert formula.is_any
    first, last = formula.parts
    assert isinstance(last, Above)
    assert not first.is_any  # the opposite of (a or (b and c))
    assert first.parts[1].is_any
    assert isinstance(parse("(time > 1) until[0,5] (time > 2)").formula, UntilHolds)


def test_a_quantity_is_known_at_the_end_only():
    spec = parse("lost[1] / start[1] < 0.2")
    known = spec.known({}, {"lost[1]": 3.0, "start[1]": 12.0})
    assert known.tolist() == [pytest.approx(-0.05)]
    mixed = parse("always (count(team 1) > 2) and lost[1] < 5")
    known = mixed.known({"count(team 1)": np.array([12.0, 9.0, 9.0])}, {"lost[1]": 9.0})
    assert known.tolist() == [10.0, 7.0, -4.0]
    assert (spec.can_guide, mixed.can_guide) == (False, True)


REFUSED = {
    "": "a signal, a quantity or a number is expected",
    "1 < 2": "names nothing of a game",
    "distance(team 1, team 1)": "a comparison is missing",
    "distance(team 9, team 1) > 2 m": "there is no team 9",
    "distance(team 1) > 2": "takes 2 arguments, not 1",
    "distnce(team 1, team 1) > 2": "did you mean 'distance'",
    "distance(wolves, all) > 2": "there are no entities 'wolves'",
    "distance(all, all) > 2 s": "m and s cannot be compared",
    "distance(all, all) > 2 parsecs": "after '...'|parsecs",
    "always[3,1] (time > 2)": "ends before it begins",
    "always[0.21,0.29] (time > 2)": "no step is within the window",
    "time > 1 until[0.21,0.29] time > 2": "no step is within the window",
    "always[21,30] (time > 2)": "begins after the end of the game, at 20 s",
    "eventually[inf,inf] (time > 2)": "begins after the end of the game",
    "always[15,18] (time > 2 -> eventually[6,7] (time > 2))": "begins after the end",
    "time > 1 until[15,18] not always[6,7] (time > 2)": "begins after the end",
    "always[0,2 m] (time > 2)": "is no time",
    "always[a,2] (time > 2)": "a time is expected",
    "always(time > 2": r"'\)' is expected, not 'the end'",
    "time > 2 s time": "is not expected here",
    "time > 2 time": "'time' is not a unit",
    "time > (time > 2)": "a number is expected, not a condition",
    "time > $": "cannot be read",
    "(" * 80 + "time > 2": "nested too deeply",
    "not " * 80 + "time > 2": "nested too deeply",
    "time > " + "-" * 80 + "2": "nested too deeply",
    "time > 2" + " " * 1000: "at most 1000 are allowed",
    "inside(all, 7) > 2": "no boundaries of the mission have the id 7",
    "clearance(nobody) > 2": "there are no entities",
    "max_distance(all, team 1) > 2": "takes a point",
    "distance(all, point 1 2) > 2": "is no point",
    "min(prey.Boids.speeed) > 2": "did you mean",
    "time + distance(all, all) > 2": "cannot be compared or added",
}


@pytest.mark.parametrize("text", REFUSED)
def test_what_is_no_specification_is_refused_in_one_sentence(text):
    with pytest.raises(ParameterError, match=REFUSED[text]) as error:
        parse(text)
    assert "\n" not in str(error.value)


def test_a_quantity_that_games_do_not_have():
    with pytest.raises(ParameterError, match="there is no 'scores"):
        parse("scores[2] > 3").check(["score[2]", "t"])


def test_a_function_is_a_signal(tmp_path):
    def crowd(sim):
        return np.bincount(sim.state.population.bodies.world, minlength=sim.n_worlds)

    sim = Simulation(MISSION, [1, 2])
    own = Monitor(Specification.of_function(crowd, MISSION), sim)
    called = Monitor(parse("always (crowd() > 0)", crowd=crowd), sim)
    shipped = Monitor(parse("always (count(all) > 0)"), sim)
    sim.run()
    assert own.robustness().tolist() == called.robustness().tolist()
    assert shipped.robustness()[0] > 0
    path = tmp_path / "own.py"
    path.write_text("def early(sim):\n    return 5.0 - sim.t\n\nA = 3\n")
    sim = Simulation(MISSION, [1, 2])
    early = Monitor(parse(f"{path}:early"), sim)
    same = Monitor(parse("always (time < 5 s)"), sim)
    sim.run()
    assert early.robustness().tolist() == same.robustness().tolist() == [5.0 - 20.0] * 2
    with pytest.raises(ParameterError, match=r"has no function 'erly' \(did you mean 'early'"):
        parse(f"{path}:erly")
    with pytest.raises(ParameterError, match=r"returned shape \(\)"):
        Monitor(parse("always (one() > 0)", one=lambda sim: 1.0), Simulation(MISSION, 1)).finish(0)


def test_a_comparison_of_no_number_is_an_error():
    sim = Simulation(MISSION, 1)
    with pytest.raises(ParameterError, match=r"at 0 s a comparison is of no number"):
        Monitor(parse("always (nothing() > 0)", nothing=lambda sim: [np.nan]), sim).finish(0)
