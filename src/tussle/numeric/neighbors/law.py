"""A neighbour law: a function of a pair of entities, and the reduction of each of its results."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from tussle.errors import DeclarationError, listed, nearest_name
from tussle.numeric.refusals import label

REDUCTIONS = ("sum", "mean", "min", "max", "count", "nearest", "each")
PAIR = ("offset_x", "offset_y", "offset_z", "distance", "distance_squared", "inverse_distance")
"""Arguments that describe the pair. All others are columns of the row, or with the prefix OTHER columns of the neighbour."""
OTHER = "other_"
TEAMS = (None, "own", "other")


@dataclass(frozen=True, eq=False)
class Law:
    """A function called for each pair of a row and a neighbour in range, and how its results are reduced per row.

    Attributes:
        function: Takes the arguments by name and returns the contributions in order, or None to skip the pair.
        arguments: Names of its arguments.
        radii: Columns or numbers [m]; a neighbour must be nearer than all of them.
        teams: None for all teams, "own" or "other".
        reductions: Contribution name -> reduction.
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
                    f"{label(self.function)}: {name}={reduction!r} is not a reduction{nearest_name(str(reduction), REDUCTIONS)}; "
                    f"{listed(REDUCTIONS)}"
                )
        if self.teams not in TEAMS:
            raise DeclarationError(
                f"{label(self.function)}: teams={self.teams!r} must be None, 'own' or 'other'"
            )
        if self.lists and set(self.reductions.values()) != {"each"}:
            raise DeclarationError(
                f"{label(self.function)}: use the reduction 'each' for all contributions or for none"
            )

    @property
    def lists(self) -> bool:
        """True if the law gives one value per pair instead of one per row."""
        return "each" in self.reductions.values()

    @property
    def names(self) -> tuple[str, ...]:
        """Values needed for each pair: the arguments, and those used by the reductions."""
        return (*self.arguments, *(["other_id"] if "nearest" in self.reductions.values() else []))

    @property
    def columns(self) -> tuple[str, ...]:
        """Columns that the law reads; those of the neighbour keep their prefix."""
        radii = [radius for radius in self.radii if isinstance(radius, str)]
        return tuple(dict.fromkeys(name for name in (*self.names, *radii) if name not in PAIR))
