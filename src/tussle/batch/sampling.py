"""Chooses the points of a batch by a sampling method and a seed; the same points on every machine."""

from __future__ import annotations

import itertools
import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tussle.batch.statistics import scipy_package
from tussle.batch.variables import Choice, Point, Range, Value, Variable
from tussle.errors import ParameterError, clipped, listed, nearest_name

Floats = NDArray[np.float64]

METHODS = ("lhs", "sobol", "saltelli", "grid", "list", "product")
DEFAULT_N = {"lhs": 20, "sobol": 32, "saltelli": 64, "product": 20}
"""Points that are drawn where nobody says how many, before they are crossed with choices or with one another.

Sobol sequences are balanced at powers of two (Owen, On dropping the first Sobol' point, 2020), so those get one.
"""

DEFAULT_LEVELS = 5
"""Values of a range without levels in a grid."""

MAX_POINTS = 1_000_000

MAX_IMPROVED = 100
"""Largest Latin hypercube whose points are spread further by exchanges: up to here that takes about a second at most."""


def method_for(variables: Sequence[Variable], method: str = "") -> str:
    """The method itself, or for "" the one that fits: "grid" for choices and ranges with levels, "lhs" for ranges, "product" for both.

    Raises:
        ParameterError: There is no such method.
    """
    if method:
        if method not in METHODS:
            raise ParameterError(
                f"there is no sampling {clipped(method)!r}{nearest_name(method, METHODS)}; {listed(METHODS)}"
            )
        return method
    if all(isinstance(variable, Choice) or variable.levels is not None for variable in variables):
        return "grid"
    return "lhs" if not any(isinstance(variable, Choice) for variable in variables) else "product"


def sample(
    variables: Sequence[Variable], method: str = "", n: int | None = None, seed: int = 0
) -> list[Point]:
    """Points in a fixed order: one dict of values per point, in the order of the variables.

    Args:
        variables: What varies; without any there is one point, without values.
        method: One of `METHODS`: "lhs" (Latin hypercube), "sobol" (scrambled Sobol sequence), "saltelli" (the rows from which
            variance-based indices are computed), "grid" (all combinations), "list" (the first choices together, then the second
            ones ...), "product" (all choices at each point of a Latin hypercube of the ranges); "" is what `method_for` says.
        n: Points to draw, by default `DEFAULT_N`. Saltelli has len(variables) + 2 rows for each, a product all choices.
            Nothing is drawn for a grid and a list.
        seed: Of the drawing.

    Raises:
        ParameterError: The method is unknown or does not fit the variables, a name stands twice, or n or seed is not allowed.
    """
    chosen = method_for(variables, method)
    names = [variable.name for variable in variables]
    doubled = [name for name, times in Counter(names).items() if times > 1]
    if doubled:
        raise ParameterError(f"{', '.join(doubled)}: this varies twice; say all of its values at once")
    for word, value, least in (("n", n, 1), ("seed", seed, 0)):
        is_whole = hasattr(value, "__index__") and not isinstance(value, bool)
        if value is not None and not (is_whole and value >= least):
            raise ParameterError(f"{word} = {value!r} is not allowed; it takes a whole number >= {least}")
    if not variables:
        if method or n is not None:
            raise ParameterError("nothing varies, so there is nothing to sample; say what varies first")
        return [{}]
    if chosen == "product" and not any(isinstance(variable, Range) for variable in variables):
        chosen = "grid"  # choices alone: there is nothing to draw
    _check_size(chosen, variables, n)
    rows = _DESIGNS[chosen](variables, n or DEFAULT_N.get(chosen, 0), seed)
    return [dict(zip(names, row, strict=True)) for row in rows]


def _check_size(method: str, variables: Sequence[Variable], n: int | None) -> None:
    """Refuse too many points before they are made, and a number of points for a method that takes none."""
    drawn = DEFAULT_N.get(method, 0) if n is None else n
    crossed = math.prod(len(_grid_values(v)) for v in variables if method == "grid" or isinstance(v, Choice))
    total = {
        "grid": crossed,
        "product": drawn * crossed,
        "saltelli": drawn * (len(variables) + 2),
        "list": 0,
    }.get(method, drawn)
    if total > MAX_POINTS:
        raise ParameterError(
            f"{method}: these are {total:,} points, more than {MAX_POINTS:,}; take fewer, or fewer values of what varies"
        )
    if n is not None and method not in DEFAULT_N:
        all_of_them = f"all {total:,} combinations" if method == "grid" else "the choices as they stand"
        raise ParameterError(
            f"{method} plays {all_of_them}, so {n} points cannot be drawn; leave the number out, or sample by lhs"
        )


# -- the methods: rows of values, in order ---------------------------------------------------------------------------------

Rows = Iterable[Sequence[Value]]


def _lhs(variables: Sequence[Variable], n: int, seed: int) -> Rows:
    # One variable alone has nothing to exchange, and its discrepancies would differ by rounding errors only.
    is_improved = len(variables) > 1 and 2 < n <= MAX_IMPROVED
    sampler = scipy_package().stats.qmc.LatinHypercube(
        d=len(variables),
        optimization="random-cd" if is_improved else None,
        rng=np.random.default_rng(seed),
    )
    shares = sampler.random(n)
    for j, variable in enumerate(variables):
        if isinstance(variable, Choice) or (variable.n_values or n + 1) <= n:
            shares[:, j] = _evenly(shares[:, j])
    return _values(variables, shares)


def _evenly(column: Floats) -> Floats:
    """The column with each point at the same place of its stratum.

    Then k equal parts get n / k points each, rounded up or down; with a place of its own in each stratum, a part could get two
    fewer than another. Where that place is remains by chance.
    """
    n = len(column)
    stratum = np.argsort(np.argsort(column))
    place = min(max(column[0] * n - stratum[0], 0.0), np.nextafter(1.0, 0.0))
    return np.asarray((stratum + place) / n)


def _sobol(variables: Sequence[Variable], n: int, seed: int) -> Rows:
    return _values(variables, _sobol_points(len(variables), n, seed))


def _sobol_points(d: int, n: int, seed: int) -> Floats:
    """The first n points of a scrambled Sobol sequence, shares of [0, 1), (n, d)."""
    sampler = scipy_package().stats.qmc.Sobol(d=d, scramble=True, rng=np.random.default_rng(seed))
    # As many as a power of two, then cut: scipy warns of any other number, and who asks for n has decided.
    return np.asarray(sampler.random_base2((n - 1).bit_length())[:n])


def _saltelli(variables: Sequence[Variable], n: int, seed: int) -> Rows:
    """Saltelli's sample: for each of n base points A, the point A, then A with one variable from B for each variable, then B.

    Saltelli et al., Variance based sensitivity analysis of model output, Computer Physics Communications 181 (2010), table 2 (b);
    in the order in which `SALib.analyze.sobol` with calc_second_order=False expects the results.
    """
    k = len(variables)
    base = _sobol_points(2 * k, n, seed)
    a, b = base[:, :k], base[:, k:]
    shares = np.repeat(a[:, None, :], k + 2, axis=1)
    for j in range(k):
        shares[:, 1 + j, j] = b[:, j]
    shares[:, -1, :] = b
    return _values(variables, shares.reshape(-1, k))


def _grid(variables: Sequence[Variable], _n: int, _seed: int) -> Rows:
    return itertools.product(*(_grid_values(variable) for variable in variables))


def _list(variables: Sequence[Variable], _n: int, _seed: int) -> Rows:
    columns = []
    for variable in variables:
        if isinstance(variable, Range):
            raise ParameterError(
                f"list: {variable.name} is a range, of which there is no first value; give choices, or sample by product"
            )
        columns.append(variable.values)
    lengths = {variable.name: variable.n_values for variable in variables}
    if len(set(lengths.values())) > 1:
        counts = ", ".join(f"{name} has {length}" for name, length in lengths.items())
        raise ParameterError(f"list: all need as many values as the others, but {counts}; or sample by grid")
    return zip(*columns, strict=True)


def _product(variables: Sequence[Variable], n: int, seed: int) -> Rows:
    ranges = [variable for variable in variables if isinstance(variable, Range)]
    choices = [variable for variable in variables if isinstance(variable, Choice)]
    drawn = _lhs(ranges, n, seed)
    order = [[*ranges, *choices].index(variable) for variable in variables]
    chosen = list(itertools.product(*(choice.values for choice in choices)))
    for row, choice in itertools.product(drawn, chosen):
        values = (*row, *choice)
        yield [values[i] for i in order]


def _values(variables: Sequence[Variable], shares: Floats) -> Rows:
    """Values at shares of their variables, shares (n, k)."""
    columns = [
        [v.value_at(share) for share in column.tolist()]
        for v, column in zip(variables, shares.T, strict=True)
    ]
    return zip(*columns, strict=True)


def _grid_values(variable: Variable) -> Sequence[Value]:
    if isinstance(variable, Choice):
        return variable.values
    # Of few whole numbers some are the same one, rounded: once is enough where nobody asked for so many levels.
    return tuple(dict.fromkeys(variable.spread(variable.levels or DEFAULT_LEVELS)))


_DESIGNS: dict[str, Callable[[Sequence[Variable], int, int], Any]] = {
    "lhs": _lhs,
    "sobol": _sobol,
    "saltelli": _saltelli,
    "grid": _grid,
    "list": _list,
    "product": _product,
}
