"""What a page is made of: sections with sentences, plates and tables."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Plate:
    """A plot with what is said about it.

    Args:
        name: What its files are called, without an ending.
        title: What it shows.
        caption: How to read it.
        draw: Makes the figure.
    """

    name: str
    title: str
    caption: str
    draw: Callable[[], Figure]


@dataclass(frozen=True)
class Column:
    """A column of a table.

    Args:
        name: Its head.
        kind: "text", "number" (to the right) or "code" (to be typed or copied).
    """

    name: str
    kind: str = "number"


@dataclass(frozen=True)
class Table:
    """A table with what is said about it.

    Args:
        title: What it shows; empty where the section says it.
        columns: Its columns.
        rows: Cells as they are shown, row by row.
        caption: How to read it.
        colours: A colour for the first cell of each row; empty for none.
    """

    title: str
    columns: tuple[Column, ...]
    rows: tuple[tuple[str, ...], ...]
    caption: str = ""
    colours: tuple[str, ...] = ()


@dataclass(frozen=True)
class Section:
    """A part of the page under one heading.

    Args:
        name: Its identifier.
        title: Its heading.
        lead: Sentences under the heading, one paragraph each.
        plates: Its plots.
        tables: Its tables.
        facts: Names and values, as a list.
    """

    name: str
    title: str
    lead: tuple[str, ...] = ()
    plates: tuple[Plate, ...] = ()
    tables: tuple[Table, ...] = ()
    facts: tuple[tuple[str, str], ...] = field(default=())

    @property
    def is_empty(self) -> bool:
        """Nothing is to be seen under the heading."""
        return not (self.lead or self.plates or self.tables or self.facts)
