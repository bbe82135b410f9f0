"""Rule of the conformance kit: a plugin's numbers stay finite for all allowed parameters."""

from __future__ import annotations

import contextlib
import math
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from tussle.api import PositiveParam
from tussle.declare.columns import MAX_NUMBER, Handle, Param
from tussle.engine.simulation import Simulation
from tussle.errors import ConformanceError, MissionError, ParameterError, PluginError
from tussle.testing.game import ConformanceGame
from tussle.testing.lines import lines_of

RULE = "finite"
STEPS = 8
NEAR = 1e-6
"""Distance to an exclusive bound at which a parameter is tried, relative to its default's distance."""


MAX_WORLDS = 300
EXTREMES = (0.0, 1e-300, -1e-300, MAX_NUMBER, -MAX_NUMBER)


@dataclass(frozen=True)
class Case:
    """One parameter with an allowed but unusual value; `words` describe it."""

    name: str
    value: Any
    words: str


def check_limits(game: ConformanceGame) -> None:
    """Check that all columns stay finite with each parameter at its finite bounds, and at 0.1 and 10 times its default, where it is taken.

    Raises:
        ConformanceError: A number is not finite, or the plugin raises an error.
    """
    _check(game, [Case("", None, "with the default parameters"), *_cases(game, _values)], STEPS)


def check_extremes(game: ConformanceGame) -> None:
    """Check that the first step is finite or refused with each parameter at 0, its negated default, and extreme numbers.

    Raises:
        ConformanceError: A number is not finite, or the plugin raises an error.
    """
    _check(game, list(_cases(game, _extremes)), 1)


def _check(game: ConformanceGame, cases: list[Case], n_steps: int) -> None:
    most = Handle.most_worlds(type(game.plugin)) or MAX_WORLDS
    for first in range(0, len(cases), most):
        some = cases[first : first + most]
        try:
            _play(game, some, n_steps)
        except MissionError:  # such as no free position for an entity, which is allowed
            for case in some:
                with contextlib.suppress(MissionError):
                    _play(game, [case], n_steps)


def _is_taken(plugin: Any, case: Case) -> bool:
    """Return True if a plugin does not refuse a value."""
    try:
        plugin.replace(**{case.name: case.value})
    except ParameterError:
        return False
    return True


def _extremes(column: Param, default: Any) -> Iterator[Any]:
    """Extreme values of one number, without its default."""
    if column.dtype is bool or column.choices:
        return
    for value in dict.fromkeys(map(column.dtype, (*EXTREMES, -default if math.isfinite(default) else 0.0))):
        if value != default and column.is_within(value):
            yield value


def _cases(game: ConformanceGame, values: Callable[[Param, Any], Iterator[Any]]) -> Iterator[Case]:
    """The values that the plugin does not refuse, each alone."""
    for name, column in game.plugin.params().items():
        if column.is_row_data:
            default = game.plugin.values[name]
            parts = default if column.fields else (default,)
            for i, part in enumerate(parts):
                field = f".{column.fields[i]}" if column.fields else ""
                for value in values(column, part):
                    whole = (*parts[:i], value, *parts[i + 1 :]) if column.fields else value
                    case = Case(name, whole, f"with {name}{field} = {value!r}")
                    if _is_taken(game.plugin, case):
                        yield case


def _values(column: Param, default: Any) -> Iterator[Any]:
    """Values to try for one number, without its default."""
    if column.dtype is bool:
        yield not default
        return
    tried = [*column.choices]
    if not column.choices:
        tried = [b for b in (column.ge, column.le) if b is not None and math.isfinite(b)]
        for bound, sign in ((column.gt, 1.0), (column.lt, -1.0)):
            if bound is not None and math.isfinite(bound) and not isinstance(column, PositiveParam):
                distance = abs(default - bound) if math.isfinite(default) and default != bound else 1.0
                tried.append(bound + sign * (NEAR * distance if column.dtype is float else 1))
        if math.isfinite(default):
            tried += [0.1 * default, 10.0 * default]
    for value in dict.fromkeys(column.dtype(v) for v in tried):
        if value != default and column.is_within(value):
            yield value


def _play(game: ConformanceGame, cases: list[Case], n_steps: int) -> None:
    plugin = game.plugin
    params: dict[str, list[Any]] = {}
    for name, column in plugin.params().items():
        if column.is_row_data:
            values = [case.value if case.name == name else plugin.values[name] for case in cases]
            params |= {f"{path}.{name}": values for path in game.paths}
    seeds = range(1, len(cases) + 1)
    # Extreme parameters may divide by zero in between, or be stiff; only the results must be finite.
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.filterwarnings("ignore", ".* is too stiff for substeps", RuntimeWarning)
        try:
            with Simulation(game.quiet, seeds, params, on_error="raise") as sim:
                for step in range(n_steps):
                    sim.step()
                    world, text = _not_finite(sim)
                    if text:
                        words = f"{cases[world].words}, {text} after {step + 1} steps"
                        raise ConformanceError(type(plugin).__name__, RULE, words)
        except PluginError as error:
            if not error.plugin:  # not raised by a plugin: the mission is impossible
                raise MissionError(error.message) from error
            words = cases[error.world].words if error.world is not None else "with unusual parameters"
            raise ConformanceError(type(plugin).__name__, RULE, f"{words}, {error}") from error


def _not_finite(sim: Simulation) -> tuple[int, str]:
    """World and description of the first number that is not finite; "" if all are finite."""
    for line in lines_of(sim).values():
        bad = np.flatnonzero(~np.isfinite(line.values))
        if line.is_made and len(bad):
            return int(line.world[bad[0]]), f"{line.name} is {line.values[bad[0]]}"
    for group in sim.state.population.groups:
        for binding in group.walk():
            for name in binding.ragged:
                items = binding.plugin.__dict__[name]
                bad = np.flatnonzero(~np.isfinite(np.atleast_2d(items.data)).all(axis=0))
                if (
                    len(bad)
                    and name in binding.writable
                    and getattr(type(binding.spec).columns[name], "finite", True)
                ):
                    world = sim.state.population.bodies.world[group.first + int(items.row[bad[0]])]
                    text = f"an item of {'.'.join(binding.path)}.{name} is {items.data[..., bad[0]]}"
                    return int(world), text
    return 0, ""
