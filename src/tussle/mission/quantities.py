"""Types of values that are given as numbers or as texts with a unit, and read as numbers in SI units."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Generic, TypeVar

Read = TypeVar("Read")
Write = TypeVar("Write")


class Given(Generic[Read, Write]):
    """An attribute that type checkers take as set to one type and read as another. When a program runs, it is a usual attribute."""

    def __get__(self, owner: object, kind: object = None) -> Read:
        raise AttributeError

    def __set__(self, owner: object, value: Write) -> None:
        raise AttributeError


Quantity = Given[float, float | str]
"""A number, or a text such as "50 kt"."""
QuantityOrNone = Given[float | None, float | str | None]
Quantities = Given[Sequence[float], Sequence[float | str]]
"""Numbers, or texts such as "2 km", or one text of numbers."""
QuantitiesOrNone = Given[Sequence[float] | None, Sequence[float | str] | None]


def given(default: Any) -> Any:
    """The default of such an attribute."""
    return default
