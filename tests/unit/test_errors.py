"""The errors' common ancestor, the place that a plugin's failure carries, and the two phrases."""

from __future__ import annotations

import pickle

import pytest

from tussle import errors
from tussle.errors import PluginError, TussleError, listed, nearest_name


@pytest.mark.parametrize(
    ("name", "builtin"),
    [
        ("DeclarationError", TypeError),
        ("ParameterError", ValueError),
        ("UnitError", ValueError),
        ("MissionError", ValueError),
        ("MissingExtraError", ImportError),
    ],
)
def test_errors_are_ours_and_of_the_builtin_kind(name: str, builtin: type[Exception]) -> None:
    error = getattr(errors, name)
    assert issubclass(error, TussleError)
    assert issubclass(error, builtin)


def test_failure_of_a_plugin_says_where_and_survives_the_way_back_from_a_process() -> None:
    cause = ValueError("no way")
    error = PluginError(
        "raised ValueError: no way", where="prey 3", step=1234, world=17, plugin="Boids", cause=cause
    )
    assert str(error) == "Boids, prey 3, world 17, step 1234: raised ValueError: no way"
    assert error.__cause__ is cause
    again = pickle.loads(pickle.dumps(error))
    assert str(again) == str(error)
    assert (again.step, again.world, str(again.cause)) == (1234, 17, "no way")
    assert str(PluginError("late")) == "late"


def test_nearest_name_guesses_well_or_not_at_all() -> None:
    assert nearest_name("max_sped", ["min_speed", "max_speed"]) == " (did you mean 'max_speed'?)"
    assert nearest_name("MAXSPEED", ["max_speed", "gain"]) == " (did you mean 'max_speed'?)"
    assert nearest_name("zzz", ["max_speed"]) == ""
    assert nearest_name("x", []) == ""


def test_listed_names_all() -> None:
    assert listed(["b", "a"]) == "there are: b, a"
    assert listed(iter(())) == "there are none"
