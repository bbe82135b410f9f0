"""Points: which ones, how many, in which order."""

import itertools

import numpy as np
import pytest

from tussle.batch.sampling import DEFAULT_N, method_for, sample
from tussle.batch.variables import Choice, Range
from tussle.errors import ParameterError

SPEED = Range("speed", 20, 30)
GAIN = Range("gain", 1e-3, 10, is_log=True)
COUNT = Range("count", 1, 6, is_int=True)
TACTIC = Choice("tactic", ("keep", "switch", "mix"))
MODEL = Choice("model", ("a", "b"))


def column(points, name):
    return [point[name] for point in points]


def test_without_variables_there_is_one_point_without_values():
    assert sample([]) == [{}]
    for arguments in ({"method": "lhs"}, {"n": 3}):
        with pytest.raises(ParameterError, match="nothing varies, so there is nothing to sample"):
            sample([], **arguments)


@pytest.mark.parametrize(
    ("variables", "method"),
    [
        ([TACTIC, MODEL], "grid"),
        ([TACTIC, Range("x", 0, 1, levels=3)], "grid"),
        ([Range("x", 0, 1, levels=3)], "grid"),
        ([SPEED, GAIN], "lhs"),
        ([SPEED, Range("x", 0, 1, levels=3)], "lhs"),
        ([SPEED, TACTIC], "product"),
    ],
)
def test_the_method_that_fits(variables, method):
    assert method_for(variables) == method
    assert sample(variables, seed=3) == sample(variables, method, seed=3)


@pytest.mark.parametrize("method", sorted(DEFAULT_N))
def test_a_seed_gives_the_same_points_and_another_seed_others(method):
    variables = [SPEED, GAIN, COUNT, TACTIC]
    assert sample(variables, method, 9, seed=4) == sample(variables, method, 9, seed=4)
    assert sample(variables, method, 9, seed=4) != sample(variables, method, 9, seed=5)


LAST_POINTS = {
    "lhs": [[21.5877874891, 0.004281336232671, 5, "mix"], [22.9655203266, 5.75288664144, 3, "mix"]],
    "sobol": [[23.7215945963, 0.4505131022271, 1, "mix"], [26.237914525, 0.00279400228542, 4, "keep"]],
}


def test_the_points_are_those_of_every_machine():
    for method, values in LAST_POINTS.items():
        points = sample([SPEED, GAIN, COUNT, TACTIC], method, 10)
        assert [list(point.values()) for point in points[-2:]] == values, method


def test_latin_hypercube_has_one_point_in_each_stratum():
    points = sample([SPEED, GAIN], "lhs", n=50, seed=2)
    speed = (np.array(column(points, "speed")) - 20) / 10
    gain = np.log(np.array(column(points, "gain")) / 1e-3) / np.log(1e4)
    for shares in (speed, gain):
        assert sorted((shares * 50).astype(int).tolist()) == list(range(50))


def test_grid_is_all_combinations_the_last_variable_fastest():
    x = Range("x", 0, 1, levels=3)
    points = sample([MODEL, x], "grid")
    assert [tuple(p.values()) for p in points] == list(itertools.product("ab", (0.0, 0.5, 1.0)))
    assert column(sample([SPEED], "grid"), "speed") == [20.0, 22.5, 25.0, 27.5, 30.0]
    assert column(sample([Range("n", 1, 3, is_int=True)], "grid"), "n") == [1, 2, 3]
    assert column(sample([Range("n", 1, 9, is_int=True, is_log=True)], "grid"), "n") == [1, 2, 3, 5, 9]


def test_list_takes_the_choices_side_by_side():
    points = sample([Choice("x", (1, 2)), MODEL], "list")
    assert points == [{"x": 1, "model": "a"}, {"x": 2, "model": "b"}]


def test_product_crosses_each_drawn_point_with_all_choices_the_choices_fastest():
    points = sample([MODEL, SPEED, TACTIC, GAIN], "product", n=4, seed=8)
    drawn = sample([SPEED, GAIN], "lhs", n=4, seed=8)
    crossed = list(itertools.product("ab", TACTIC.values))
    assert len(points) == 24
    for i, point in enumerate(points):
        assert {name: point[name] for name in ("speed", "gain")} == drawn[i // 6]
        assert (point["model"], point["tactic"]) == crossed[i % 6]


def test_saltelli_has_the_rows_of_salib():
    """A row that differs from the one before in the same columns, for each row of both designs."""
    from SALib.sample import sobol

    variables = [Range(name, 0, 1) for name in "xyz"]
    rows = np.array([list(p.values()) for p in sample(variables, "saltelli", n=16)])
    problem = {"num_vars": 3, "names": list("xyz"), "bounds": [[0, 1]] * 3}
    theirs = sobol.sample(problem, 16, calc_second_order=False, seed=1)
    assert rows.shape == theirs.shape == (80, 3)
    assert np.array_equal(rows[1:] == rows[:-1], theirs[1:] == theirs[:-1])
    blocks = rows.reshape(16, 5, 3)
    for j in range(3):
        assert np.array_equal(blocks[:, 1 + j, j], blocks[:, -1, j])


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (([SPEED], "lsh"), r"there is no sampling 'lsh' \(did you mean 'lhs'\?\); there are: lhs, sobol, saltelli, grid, list, product"),
        (([SPEED, SPEED, GAIN], "lhs"), "speed: this varies twice"),
        (([SPEED], "lhs", 0), "n = 0 is not allowed; it takes a whole number >= 1"),
        (([SPEED], "lhs", 2.5), "n = 2.5 is not allowed"),
        (([SPEED], "lhs", True), "n = True is not allowed"),
        (([SPEED], "lhs", 5, -1), "seed = -1 is not allowed; it takes a whole number >= 0"),
        (([SPEED], "lhs", 1_000_001), "lhs: these are 1,000,001 points, more than 1,000,000"),
        (([SPEED, GAIN], "saltelli", 250_001), "saltelli: these are 1,000,004 points"),
        (([SPEED, TACTIC], "product", 400_000), "product: these are 1,200,000 points"),
        (([Range(c, 0, 1, levels=101) for c in "xyz"], "grid"), "grid: these are 1,030,301 points"),
        (([TACTIC, MODEL], "grid", 5), "grid plays all 6 combinations, so 5 points cannot be drawn"),
        (([TACTIC, MODEL], "", 5), "leave the number out, or sample by lhs"),
        (([TACTIC], "list", 5), "list plays the choices as they stand, so 5 points cannot be drawn"),
        (([TACTIC, SPEED], "list"), "list: speed is a range, of which there is no first value"),
        (([TACTIC, MODEL], "list"), "list: all need as many values as the others, but tactic has 3, model has 2"),
    ],
)  # fmt: skip
def test_what_is_not_allowed(arguments, said):
    with pytest.raises(ParameterError, match=said):
        sample(*arguments)
