"""A specification: what must hold in each game, and how far a game is from breaking it."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tussle.arguments import explained
from tussle.batch.quantities import column_name
from tussle.batch.stack import metrics_of
from tussle.declare.units import COMPOUND_EXAMPLES, UNITS, unit_of
from tussle.engine.result import WorldResult
from tussle.engine.simulation import Simulation
from tussle.errors import ParameterError, listed, nearest_name
from tussle.mission import Mission, PluginFile
from tussle.stress.formulas import Above, Formula, Window
from tussle.stress.grammar import SpecificationReader
from tussle.stress.signals import Factory, Signal
from tussle.stress.terms import AtEnd, OfStep, SignalTerm

Function = Callable[[Simulation], Any]


@explained
@dataclass(frozen=True)
class Specification:
    """What must hold in each game of a mission.

    Attributes:
        text: As it was given.
        formula: The formula over terms.
        terms: The terms by name: differences that are to be positive.
        dt: Time between samples, that is of a step [s].
    """

    text: str
    formula: Formula
    terms: Mapping[str, SignalTerm]
    dt: float

    @classmethod
    def parse(
        cls, text: str, mission: Mission, functions: Mapping[str, Function] | None = None
    ) -> Specification:
        """Read a specification.

        Args:
            text: Such as "always[0,60] (distance(team 1, team 1) > 2 m)", "lost[1] / start[1] < 0.2", or "FILE.py:NAME" for a function
                that is to be positive at all steps.
            mission: The mission; its teams, blocks, boundaries and columns may be named.
            functions: Further signals that are called as name(): functions of the simulation that return one number per world.

        Raises:
            ParameterError: The text is no specification, or names what the mission does not have.
        """
        if (file := text.rpartition(":")[0]).endswith(".py"):
            function = function_of(Path(file), text.rpartition(":")[2])
            return cls.of_function(function, mission, text)
        length = mission.end - mission.start if "time" in mission.end_conditions else math.inf
        reader = SpecificationReader(text, Factory(mission, functions or {}), mission.dt, length)
        formula = reader.read()
        if not any(isinstance(p, OfStep | AtEnd) for term in reader.terms.values() for p in term.parts()):
            raise ParameterError(f"specification {text!r} names nothing of a game: a signal or a quantity")
        return cls(text, formula, reader.terms, mission.dt)

    @classmethod
    def of_function(cls, function: Function, mission: Mission, text: str = "") -> Specification:
        """A function of the simulation that returns one number per world, (n_worlds,), positive at all steps of a good game."""
        name = getattr(function, "__name__", "function")
        signal = Factory(mission, {name: function}).make(name, [])
        return cls(text or f"{name}()", Window(Above("0")), {"0": OfStep(signal)}, mission.dt)

    @property
    def signals(self) -> dict[str, Signal]:
        """The signals by their text."""
        parts = [part for term in self.terms.values() for part in term.parts()]
        return {str(part.signal): part.signal for part in parts if isinstance(part, OfStep)}

    @property
    def quantities(self) -> list[AtEnd]:
        """The quantities that are known at the end."""
        return [p for term in self.terms.values() for p in term.parts() if isinstance(p, AtEnd)]

    @property
    def unit(self) -> str:
        """SI unit of the robustness; "" without one, or where comparisons have different units."""
        found = {term.unit for term in self.terms.values()}
        names = [*UNITS, *COMPOUND_EXAMPLES]
        return next((n for n in names if found == {unit_of(n).dimension} and unit_of(n).factor == 1), "")

    @property
    def can_guide(self) -> bool:
        """Something of the robustness is known before a game ends, so that splitting can tell good games from better ones."""
        parts = [self.formula]
        while parts:
            part = parts.pop()
            if isinstance(part, Window) and not part.is_any and not _is_late(part.inner):
                return True
            parts += getattr(part, "parts", ())
        return False

    def check(self, columns: Collection[str]) -> None:
        """Check that games have its quantities.

        Raises:
            ParameterError: There is none of that name.
        """
        for each in self.quantities:
            each.quantity.names(columns)

    def known(self, signals: Mapping[str, np.ndarray], result: Mapping[str, float]) -> np.ndarray:
        """What the robustness is at most, as known at each sample, (n_samples,); the last is the robustness. See `Formula.known`.

        Args:
            signals: Values of each signal, (n_samples,).
            result: Quantities at the end; not used without `quantities`.

        Raises:
            ParameterError: A signal is not a number, or there is no such quantity.
        """
        return self.formula.known(self._traces(signals, result))

    def present(self, signals: Mapping[str, np.ndarray], result: Mapping[str, float]) -> np.ndarray:
        """Robustness of each sample alone, (n_samples,), see `Formula.present`; arguments and errors as of `known`."""
        return self.formula.present(self._traces(signals, result))

    def progress(
        self, signals: Mapping[str, np.ndarray], result: Mapping[str, float], is_over: bool
    ) -> tuple[np.ndarray, np.ndarray, float]:
        """What a game has shown, which may go on: see `tussle.stress.Monitor.progress`; arguments and errors as of `known`."""
        known = self.known(signals, result)
        ended, n = float(known[-1]), len(known)
        if not is_over:  # with one more sample, the last one counts as one of a game that goes on
            longer = {name: np.append(values, values[-1]) for name, values in signals.items()}
            known = self.known(longer, result)[:n]
        return known, self.present(signals, result), ended

    def _traces(
        self, signals: Mapping[str, np.ndarray], result: Mapping[str, float]
    ) -> dict[str, np.ndarray]:
        """Values of each term, (n_samples,)."""
        columns = {name: np.array([value]) for name, value in result.items()}
        values: dict[str, np.ndarray] = dict(signals)
        for each in self.quantities:
            values[str(each.quantity)] = each.quantity.evaluate(columns)
        n = max((len(v) for v in signals.values()), default=1)
        traces = {}
        for name, term in self.terms.items():
            found = np.ascontiguousarray(np.broadcast_to(term.values(values), (n,)), dtype=np.float64)
            if np.isnan(found).any():
                place = int(np.flatnonzero(np.isnan(found))[0])
                raise ParameterError(
                    f"specification {self.text!r}: at {place * self.dt:.6g} s a comparison is of no number (NaN)"
                )
            traces[name] = found
        return traces

    def __str__(self) -> str:
        return self.text


def _is_late(formula: Formula) -> bool:
    return formula.delay >= 2**61


def function_of(path: Path, name: str) -> Function:
    """A function of a Python file, which is run.

    Raises:
        ParameterError: It has no such function.
        MissionError: The file cannot be read or run.
    """
    module = PluginFile.of(path).imported()
    found = getattr(module, name, None)
    if not callable(found):
        known = [n for n, v in vars(module).items() if callable(v) and not n.startswith("_")]
        raise ParameterError(f"{path} has no function {name!r}{nearest_name(name, known)}; {listed(known)}")
    return found  # type: ignore[no-any-return]


def columns_of(result: WorldResult) -> dict[str, float]:
    """The quantities of a game, named as in a batch."""
    found = {column_name(name, team): value for team, name, value in metrics_of(result)}
    for team, start in result.born.items():
        found[column_name("lost", team)] = float(start - result.alive.get(team, 0))
    for team in result.scores:
        found[column_name("wins", team)] = float(result.winner == team)
    if result.scores:
        found["ties"] = float(result.winner is None)
    return found | {"t": result.t, "steps": float(result.steps)}
