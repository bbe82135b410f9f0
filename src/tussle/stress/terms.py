"""Terms of a specification: arithmetic over signals of each step, quantities of the end, and numbers with units."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from tussle.batch.quantities import Quantity
from tussle.declare.units import NONE, Dimension
from tussle.stress.signals import Signal

OPERATIONS = {"+": np.add, "-": np.subtract, "*": np.multiply, "/": np.divide}
Values = Mapping[str, np.ndarray]
"""Values of each signal at each sample, (n_samples,), and of each quantity, (1,)."""


class SignalTerm:
    """A number at each sample of a game.

    Attributes:
        unit: Its dimension; None where any fits, as of a bare number.
    """

    unit: Dimension | None

    def values(self, known: Values) -> np.ndarray:
        """Its value at each sample, (n_samples,), or (1,) where it does not change."""
        raise AssertionError

    def parts(self) -> Iterator[SignalTerm]:
        """It, and what it is made of."""
        yield self

    @property
    def is_late(self) -> bool:
        """It has a quantity, which is known at the end only."""
        return any(isinstance(part, AtEnd) for part in self.parts())


@dataclass(frozen=True)
class Constant(SignalTerm):
    """A number [SI]."""

    value: float
    unit: Dimension | None = None

    def values(self, known: Values) -> np.ndarray:
        return np.array([self.value])


@dataclass(frozen=True)
class OfStep(SignalTerm):
    """A signal."""

    signal: Signal

    @property
    def unit(self) -> Dimension | None:  # type: ignore[override]
        return self.signal.unit

    def values(self, known: Values) -> np.ndarray:
        return known[str(self.signal)]


@dataclass(frozen=True)
class AtEnd(SignalTerm):
    """A quantity of the game's result, as `tussle analyze` takes it."""

    quantity: Quantity
    unit: Dimension | None = None

    def values(self, known: Values) -> np.ndarray:
        return known[str(self.quantity)]


@dataclass(frozen=True)
class Arithmetic(SignalTerm):
    """Two terms, added, subtracted, multiplied or divided."""

    operator: str
    left: SignalTerm
    right: SignalTerm

    @property
    def unit(self) -> Dimension | None:  # type: ignore[override]
        left, right = self.left.unit, self.right.unit
        if self.operator in "+-":
            return right if left is None else left
        if left is None or right is None:
            # A bare number in a product has no unit; alone it takes that of what it is compared with.
            given = left if right is None else right
            return given if self.operator == "*" or right is None else None
        sign = 1 if self.operator == "*" else -1
        made = tuple(a + sign * b for a, b in zip(left, right, strict=True))
        return made if made != NONE else NONE  # type: ignore[return-value]

    def values(self, known: Values) -> np.ndarray:
        a, b = self.left.values(known), self.right.values(known)
        with np.errstate(all="ignore"):  # infinite distances, and what becomes of them
            found: np.ndarray = OPERATIONS[self.operator](a, b)
        return found

    def parts(self) -> Iterator[SignalTerm]:
        yield self
        yield from self.left.parts()
        yield from self.right.parts()
