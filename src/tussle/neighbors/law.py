"""A neighbour law as data: a function of a pair, and how what it gives is reduced."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from tussle.errors import DeclarationError, listed, nearest_name
from tussle.numeric.rk4 import label

REDUCTIONS = ("sum", "mean", "min", "max", "count", "nearest", "each")
PAIR = ("offset_x", "offset_y", "offset_z", "distance", "distance_squared", "inverse_distance")
"""Arguments that belong to a pair; the others are columns, of the other one with the prefix OTHER."""
OTHER = "other_"
TEAMS = (None, "own", "other")


@dataclass(frozen=True, eq=False)
class Law:
    """What an entity makes of each neighbour, and how that is reduced to one number a row.

    Attributes:
        function: Takes the names of a pair, returns the contributions in order, or None where the pair does not count.
        arguments: Names of its arguments.
        radii: Columns or numbers [m]; a neighbour is nearer than every one of them.
        teams: None for all, "own" or "other".
        reductions: Name -> reduction of each contribution.
    """

    function: Callable[..., Any]
    arguments: tuple[str, ...]
    radii: tuple[str | float, ...]
    teams: str | None
    reductions: dict[str, str]

    def __post_init__(self) -> None:
        for name, reduction in self.reductions.items():
            if reduction not in REDUCTIONS:
                raise DeclarationError(
                    f"{label(self.function)}: {name}={reduction!r} is no reduction{nearest_name(str(reduction), REDUCTIONS)}; "
                    f"{listed(REDUCTIONS)}"
                )
        if self.teams not in TEAMS:
            raise DeclarationError(
                f"{label(self.function)}: teams={self.teams!r} is not None, 'own' or 'other'"
            )
        if self.lists and set(self.reductions.values()) != {"each"}:
            raise DeclarationError(
                f"{label(self.function)}: a law that lists its pairs reduces every contribution by 'each', or none"
            )

    @property
    def lists(self) -> bool:
        """Whether it gives one value for each pair, instead of one for each row."""
        return "each" in self.reductions.values()

    @property
    def names(self) -> tuple[str, ...]:
        """What it reads of each pair: its arguments, and what its reductions need."""
        return (*self.arguments, *(["other_id"] if "nearest" in self.reductions.values() else []))

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns that it reads, those of the other one with their prefix."""
        radii = [radius for radius in self.radii if isinstance(radius, str)]
        return tuple(dict.fromkeys(name for name in (*self.names, *radii) if name not in PAIR))
