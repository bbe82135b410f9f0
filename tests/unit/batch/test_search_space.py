"""Variables as coordinates: distributions, positions, shares of the range."""

from __future__ import annotations

import pytest

from tussle.batch.search.proposals import generation_size
from tussle.batch.search.search_space import DIGITS, Axis
from tussle.batch.variables import Choice, Range

SPEED = Range("speed", 20, 50)
GAIN = Range("gain", 1e-3, 10, is_log=True)
COUNT = Range("count", 1, 6, is_int=True)
SIZE = Range("size", 1, 1000, is_int=True, is_log=True)
LEVELS = Range("levels", 0, 1, levels=5)
DECADES = Range("decades", 1e-6, 1e-3, is_log=True, levels=4)
TACTIC = Choice("tactic", ("keep", True, 1, 2.5))
RANGES = (SPEED, GAIN, COUNT, SIZE, LEVELS, DECADES)


def names(cases):
    return [case.name for case in cases]


@pytest.mark.parametrize(
    ("variable", "said"),
    [
        (SPEED, "FloatDistribution(high=50.0, log=False, low=20.0, step=None)"),
        (GAIN, "FloatDistribution(high=10.0, log=True, low=0.001, step=None)"),
        (COUNT, "IntDistribution(high=6, log=False, low=1, step=1)"),
        (SIZE, "IntDistribution(high=1000, log=True, low=1, step=1)"),
        (LEVELS, "IntDistribution(high=4, log=False, low=0, step=1)"),
        (DECADES, "IntDistribution(high=3, log=False, low=0, step=1)"),
        (TACTIC, "CategoricalDistribution(choices=(0, 1, 2, 3))"),
    ],
    ids=str,
)
def test_distributions(variable, said):
    assert repr(Axis(variable).distribution()) == said


@pytest.mark.parametrize("variable", RANGES, ids=names(RANGES))
def test_shares_lead_to_values_and_back(variable):
    axis = Axis(variable)
    for i in range(101):
        value = axis.at_share(i / 100)
        assert variable.low <= value <= variable.high
        assert 0.0 <= axis.share(value) <= 1.0
        assert axis.at_share(axis.share(value)) == value
        assert axis.value(axis.position(value)) == value


@pytest.mark.parametrize("variable", RANGES, ids=names(RANGES))
def test_shares_follow_the_scale(variable):
    """Equal parts of [0, 1] belong to each level and whole number, and to each part of the scale."""
    axis = Axis(variable)
    for i in range(100):
        share = (i + 0.5) / 100
        if axis.values:
            expected = axis.values[int(share * len(axis.values))]
        elif variable is COUNT:
            expected = 1 + int(share * 6)
        elif variable is SPEED:
            expected = 20 + share * 30
        else:
            low, high = (0.5, 1000.5) if variable is SIZE else (1e-3, 10.0)
            expected = low * (high / low) ** share
        assert axis.at_share(share) == pytest.approx(expected, rel=1e-4, abs=0.5 if variable is SIZE else 0)


def test_values_have_digits_that_can_be_typed():
    assert Axis(SPEED).value(23.123456789) == 23.1235
    assert Axis(GAIN).value(0.00123456789) == 0.001234568
    narrow = Range("where", 35.721025, 35.721026)
    values = {Axis(narrow).value(35.721025 + i * 1e-10) for i in range(1000)}
    assert len(values) == 1000
    assert all(len(str(v)) <= DIGITS + 10 for v in values)
    assert Axis(Range("x", 0, 0.1 + 0.2)).value(0.1 + 0.2) <= 0.1 + 0.2


def test_choices_keep_their_kind():
    axis = Axis(TACTIC)
    assert [axis.value(axis.position(v)) for v in TACTIC.values] == ["keep", True, 1, 2.5]
    assert [type(axis.value(i)) for i in range(4)] == [str, bool, int, float]


@pytest.mark.parametrize(
    ("n_axes", "per_round", "size"), [(1, 8, 8), (2, 8, 8), (2, 1, 6), (2, 4, 8), (10, 8, 16), (3, 100, 100)]
)
def test_generations_are_whole_rounds(n_axes, per_round, size):
    assert generation_size(n_axes, per_round) == size
