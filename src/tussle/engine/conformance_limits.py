"""A rule of the conformance kit: whatever its parameters, a plugin's numbers stay finite."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from tussle.columns import Output, Param, State
from tussle.engine.conformance_game import Game, is_within
from tussle.engine.simulation import Simulation
from tussle.errors import ConformanceError, MissionError, PluginError

RULE = "finite"
STEPS = 8
NEAR = 1e-6
"""How near to a bound that it must not reach a parameter is set, as a part of its default's distance."""


@dataclass(frozen=True)
class Case:
    """One parameter set to a value that is allowed but unusual; `words` say which."""

    name: str
    value: Any
    words: str


def check_limits(game: Game) -> None:
    """Each parameter at its finite bounds and at a tenth and ten times its default: all columns and bodies stay finite.

    Raises:
        ConformanceError: One does not, or the plugin raises an error.
    """
    cls = type(game.plugin)
    cases = [Case("", None, "with the default parameters"), *_cases(game)]
    most = cls.most_worlds() or len(cases)
    for first in range(0, len(cases), most):
        some = cases[first : first + most]
        try:
            _play(game, some)
        except MissionError:  # such as no room to place anybody: refused in words, which is allowed
            for case in some:
                with contextlib.suppress(MissionError):
                    _play(game, [case])


def _cases(game: Game) -> Iterator[Case]:
    for name, column in game.plugin.params().items():
        if column.is_row_data:
            default = game.plugin.values[name]
            parts = default if column.fields else (default,)
            for i, part in enumerate(parts):
                field = f".{column.fields[i]}" if column.fields else ""
                for value in _values(column, part):
                    whole = (*parts[:i], value, *parts[i + 1 :]) if column.fields else value
                    yield Case(name, whole, f"with {name}{field} = {value!r}")


def _values(column: Param, default: Any) -> Iterator[Any]:
    """Values worth trying for one number; the default is tried anyway."""
    if column.dtype is bool:
        yield not default
        return
    tried = [*column.choices]
    if not column.choices:
        tried = [b for b in (column.ge, column.le) if b is not None and math.isfinite(b)]
        for bound, sign in ((column.gt, 1.0), (column.lt, -1.0)):
            if bound is not None and math.isfinite(bound):
                room = abs(default - bound) if math.isfinite(default) and default != bound else 1.0
                tried.append(bound + sign * (NEAR * room if column.dtype is float else 1))
        if math.isfinite(default):
            tried += [0.1 * default, 10.0 * default]
    for value in dict.fromkeys(column.dtype(v) for v in tried):
        if value != default and is_within(column, value):
            yield value


def _play(game: Game, cases: list[Case]) -> None:
    plugin = game.plugin
    params: dict[str, list[Any]] = {}
    for name, column in plugin.params().items():
        if column.is_row_data:
            values = [case.value if case.name == name else plugin.values[name] for case in cases]
            params |= {f"{path}.{name}": values for path in game.paths}
    seeds = range(1, len(cases) + 1)
    # Extremes may divide by zero on the way to a number; what counts is the number.
    with np.errstate(all="ignore"):
        try:
            with Simulation(game.quiet, seeds, params, on_error="raise") as sim:
                for step in range(STEPS):
                    sim.step()
                    world, text = _not_finite(sim)
                    if text:
                        raise ConformanceError(
                            type(plugin).__name__,
                            RULE,
                            f"{cases[world].words}, {text} after {step + 1} steps",
                        )
        except PluginError as error:
            words = cases[error.world].words if error.world is not None else "with unusual parameters"
            raise ConformanceError(type(plugin).__name__, RULE, f"{words}, {error}") from error


def _not_finite(sim: Simulation) -> tuple[int, str]:
    """World and words of the first number that is not finite; "" when all are."""
    bodies = sim.population.bodies
    for name in ("pos", "vel", "quat", "omega", "health", "force", "torque"):
        bad = ~np.isfinite(np.atleast_2d(getattr(bodies, name))).all(axis=0)
        if bad.any():
            row = int(np.flatnonzero(bad)[0])
            return int(
                bodies.world[row]
            ), f"{name} of entity {int(bodies.id[row])} is {getattr(bodies, name)[..., row]}"
    for group in sim.population.groups:
        world = bodies.world[group.first : group.last]
        for binding in group.walk():
            for name, column in type(binding.spec).columns.items():
                if isinstance(column, (State, Output)) and _begins_finite(column):
                    found = _first(group.table.array(binding.places[name]))
                    if found is not None:
                        return int(world[found[0]]), f"{'.'.join(binding.path)}.{name} is {found[1]}"
            for name in binding.ragged:
                items = np.atleast_2d(binding.plugin.__dict__[name].data)
                if not isinstance(type(binding.spec).columns[name], Param) and not np.isfinite(items).all():
                    item = int(np.flatnonzero(~np.isfinite(items).all(axis=0))[0])
                    row = int(np.searchsorted(binding.plugin.__dict__[name].start, item, side="right")) - 1
                    return int(world[row]), f"an item of {'.'.join(binding.path)}.{name} is {items[:, item]}"
    return _not_finite_referee(sim)


def _not_finite_referee(sim: Simulation) -> tuple[int, str]:
    for referee in sim.referees:
        for name, column in type(referee.spec).states().items():
            per, place = referee.places[name]
            found = _first(referee.tables[per].array(place)) if _begins_finite(column) else None
            if found is not None:
                world = found[0] if per != "entity" else int(sim.population.bodies.world[found[0]])
                return world, f"{referee.spec.instance_name}.{name} is {found[1]}"
    return 0, ""


def _begins_finite(column: Any) -> bool:
    return bool(np.isfinite(column.default).all())


def _first(values: np.ndarray) -> tuple[int, Any] | None:
    """Row and value of the first number that is not finite."""
    if values.dtype != float or np.isfinite(values).all():
        return None
    row = int(np.flatnonzero(~np.isfinite(np.atleast_2d(values)).all(axis=0))[0])
    return row, values[..., row]
