"""Values of variables as parameters of Optuna, and back."""

from __future__ import annotations

import pytest

from tussle.batch.search.trials import distribution, parameter_of, value_of
from tussle.batch.variables import Choice, Range

SPEED = Range("speed", 20, 50)
VARIABLES = (
    SPEED,
    Range("gain", 1e-3, 10, is_log=True),
    Range("count", 1, 6, is_int=True),
    Range("size", 1, 1000, is_int=True, is_log=True),
    Range("levels", 0, 1, levels=5),
    Range("decades", 1e-6, 1e-3, is_log=True, levels=4),
    Choice("tactic", ("keep", True, 1, 2.5)),
)


@pytest.mark.parametrize("variable", VARIABLES, ids=lambda v: v.name)
def test_values_become_parameters_of_the_search_space_and_come_back(variable):
    space = distribution(variable)
    for i in range(101):
        value = value_of(variable, parameter_of(variable, variable.value_at(i / 100)))
        parameter = parameter_of(variable, value)
        assert space.to_external_repr(space.to_internal_repr(parameter)) == parameter
        again = value_of(variable, parameter)
        assert (type(again), again) == (type(value), value)


def test_values_have_digits_that_can_be_typed():
    assert value_of(SPEED, 23.123456789) == 23.1235
    assert value_of(VARIABLES[1], 0.00123456789) == 0.001234568
    narrow = Range("where", 35.721025, 35.721026)
    values = {value_of(narrow, 35.721025 + i * 1e-10) for i in range(1000)}
    assert len(values) == 1000
    assert all(len(str(v)) <= 16 for v in values)
    assert value_of(Range("x", 0, 0.1 + 0.2), 0.1 + 0.2) <= 0.1 + 0.2
