"""Types of values that are given as numbers or as texts with a unit, and read as numbers in SI units.

Type checkers take what an attribute is set to from `__set__`, and what is read from `__get__`; nothing of that exists when a program runs.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:

    class Quantity:
        """A number, or a text such as "50 kt"."""

        def __get__(self, owner: object, kind: object = None) -> float: ...
        def __set__(self, owner: object, value: float | str) -> None: ...

    class QuantityOrNone:
        """The same, or None."""

        def __get__(self, owner: object, kind: object = None) -> float | None: ...
        def __set__(self, owner: object, value: float | str | None) -> None: ...

    class Quantities:
        """Numbers, or texts such as "2 km", or one text of numbers."""

        def __get__(self, owner: object, kind: object = None) -> Sequence[float]: ...
        def __set__(self, owner: object, value: Sequence[float | str]) -> None: ...

    class QuantitiesOrNone:
        """The same, or None."""

        def __get__(self, owner: object, kind: object = None) -> Sequence[float] | None: ...
        def __set__(self, owner: object, value: Sequence[float | str] | None) -> None: ...

else:
    Quantity, QuantityOrNone = float, float | None
    Quantities, QuantitiesOrNone = Sequence[float], Sequence[float] | None


def given(default: Any) -> Any:
    """The default of such a value."""
    return default
