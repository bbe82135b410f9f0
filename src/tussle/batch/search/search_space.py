"""What is searched: each variable as a coordinate, in the forms in which samplers take it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from tussle.batch.variables import Choice, Value, Variable, key_of
from tussle.numeric import exp, log

if TYPE_CHECKING:
    from optuna.distributions import BaseDistribution

DIGITS = 6
"""Significant digits of a range's width in proposed values: finer than any game shows, and few enough to be typed again."""


@dataclass(frozen=True)
class Axis:
    """A variable as samplers see it: by positions.

    The position of a number is the number. That of a level or a choice is its place among them: levels lie evenly on the scale of their
    range, and choices such as True and 1 are one value to Python.

    Attributes:
        variable: What varies.
    """

    variable: Variable

    @property
    def name(self) -> str:
        return self.variable.name

    @cached_property
    def values(self) -> tuple[Value, ...]:
        """Levels or choices; none for a range of all numbers, or all whole numbers, between its bounds."""
        if isinstance(self.variable, Choice):
            return self.variable.values
        return () if self.variable.levels is None else self.variable.spread(self.variable.levels)

    @cached_property
    def _places(self) -> dict[tuple[bool, str | float], int]:
        return {key_of(value): place for place, value in enumerate(self.values)}

    def distribution(self) -> BaseDistribution:
        """What Optuna draws positions from."""
        from optuna.distributions import CategoricalDistribution, FloatDistribution, IntDistribution

        if isinstance(self.variable, Choice):
            return CategoricalDistribution(range(len(self.values)))
        if self.values:
            return IntDistribution(0, len(self.values) - 1)
        low, high, is_log = self.variable.low, self.variable.high, self.variable.is_log
        if self.variable.is_int:
            return IntDistribution(int(low), int(high), log=is_log)
        return FloatDistribution(low, high, log=is_log)

    def position(self, value: Value) -> float:
        """Where a value lies."""
        return self._places[key_of(value)] if self.values else float(value)

    def value(self, position: float) -> Value:
        """What lies at a position."""
        if self.values:
            return self.values[int(position)]
        assert not isinstance(self.variable, Choice)
        low, high = self.variable.low, self.variable.high
        if self.variable.is_int:
            return int(position)
        # As many digits of the width also where it is small beside the bounds.
        more = _exponent(max(abs(low), abs(high))) - _exponent(high / 2 - low / 2)
        return min(max(float(f"{position:.{DIGITS + min(max(more, 0), 17 - DIGITS)}g}"), low), high)

    # -- evenly between 0 and 1 -------------------------------------------------------------------------------------------

    @property
    def _ends(self) -> tuple[float, float, bool]:
        """Positions at 0 and 1, and whether the scale between is logarithmic; each whole number has a step around it."""
        assert not isinstance(self.variable, Choice)
        if self.values:
            return -0.5, len(self.values) - 0.5, False
        half = 0.5 if self.variable.is_int else 0.0
        return self.variable.low - half, self.variable.high + half, self.variable.is_log

    def share(self, value: Value) -> float:
        """Where in [0, 1] a value of a range lies, on its own scale."""
        low, high, is_log = self._ends
        position = self.position(value)
        if is_log:
            low, high, position = log(low), log(high), log(position)
        return (position / 2 - low / 2) / (high / 2 - low / 2)

    def at_share(self, share: float) -> Value:
        """The value of a range that lies there in [0, 1], on its own scale."""
        low, high, is_log = self._ends
        if is_log:
            position = exp(log(low) * (1.0 - share) + log(high) * share)
        else:
            position = low * (1.0 - share) + high * share
        assert not isinstance(self.variable, Choice)
        if self.values or self.variable.is_int:
            first, last = (
                (0, len(self.values) - 1) if self.values else (self.variable.low, self.variable.high)
            )
            position = min(max(math.floor(position + 0.5), first), last)
        return self.value(position)


def _exponent(number: float) -> int:
    """Power of ten of the first digit; by the text, since log10 of a power of ten is not the same on every machine."""
    return int(f"{number:e}".rpartition("e")[2])
