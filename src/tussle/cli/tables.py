"""Tables and lists of facts on the terminal, in one style."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterable, Sequence

from rich import box
from rich.cells import cell_len
from rich.console import RenderableType
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from tussle.cli.terminal import out
from tussle.declare.displays import decimals

Cell = str | Text
Row = tuple[str, Sequence[Cell]]
"""Style and cells of a row."""
GAP = 2
"""Distance of columns, in characters."""
MAX_TEXT_WIDTH = 30
"""Texts up to this width are not folded; longer ones are, if all columns do not fit beside each other."""


def text_table(*columns: str) -> Table:
    """Return a table of texts."""
    made = _empty()
    for name in columns:
        made.add_column(name, overflow="fold")
    return made


def number_tables(head: Sequence[Cell], rows: Sequence[Row]) -> list[Padding]:
    """Return tables that fit the terminal: a column of texts, and any number of columns of numbers.

    Texts are folded if necessary, numbers are not. Columns of numbers that do not fit beside the others make a further table
    below, with the same column of texts.

    Args:
        head: Names of the columns.
        rows: The rows, each with a style and one cell for each column.
    """
    text, *numbers = (
        max(map(_width, column)) for column in zip(head, *(cells for _, cells in rows), strict=True)
    )
    room = out().width - 1
    beside = room - sum(width + GAP for width in numbers)
    text = min(text, max(beside, min(MAX_TEXT_WIDTH, room - max(numbers, default=0) - GAP), 8))
    room -= text + GAP
    groups, used = [list[tuple[int, int]]()], 0
    for i, width in enumerate(numbers, 1):
        if groups[-1] and used + width > room:
            groups.append([])
            used = 0
        groups[-1].append((i, min(width, room)))
        used += width + GAP
    return [_number_table(head, rows, text, group) for group in groups]


def _number_table(
    head: Sequence[Cell], rows: Sequence[Row], text: int, numbers: Sequence[tuple[int, int]]
) -> Padding:
    made = _empty()
    made.add_column(head[0], overflow="fold", max_width=text)
    for i, width in numbers:
        made.add_column(head[i], justify="right", overflow="fold", min_width=width, max_width=width)
    for style, cells in rows:
        made.add_row(cells[0], *(cells[i] for i, _ in numbers), style=style)
    return indented(made)


def _empty() -> Table:
    return Table(
        box=box.SIMPLE_HEAD,
        header_style="bold cyan",
        pad_edge=False,
        show_edge=False,
        padding=(0, GAP - 1, 0, 0),
    )


def _width(cell: Cell) -> int:
    return max(map(cell_len, str(cell).split("\n")))


def indented(part: RenderableType) -> Padding:
    """Return a table or text one space from the left, below an empty line."""
    return Padding(part, (1, 0, 0, 1), expand=False)


def fact_list(facts: Iterable[tuple[str, Cell]]) -> Text:
    """Return names and values, one pair per line below an empty line; pairs without a value are left out.

    Values wrap between words. A `Text`, such as a path or a command, stays on one line, to be copied.
    """
    shown = [(name, value) for name, value in facts if value]
    indent = max((_width(name) for name, _ in shown), default=0) + GAP
    made = Text(no_wrap=True)
    for name, value in shown:
        room = max(out().width - indent - 1, 8)
        lines: Sequence[Cell] = list(value.split("\n")) if isinstance(value, Text) else _wrapped(value, room)
        for i, line in enumerate(lines):
            label = "" if i else name
            made.append("\n " + label, "dim").append(" " * (indent - cell_len(label))).append(line)
    return made


def _wrapped(text: str, width: int) -> list[str]:
    """The lines of a text, wrapped between words; a long word, such as a hash, stays whole."""
    return [
        part
        for line in text.split("\n")
        for part in textwrap.wrap(line, width, break_long_words=False, break_on_hyphens=False)
    ]


def title(name: str, *facts: str) -> Text:
    """Return a title with lines of facts under it."""
    return Text.assemble(" ", (name, "bold"), ("".join(f"\n {fact}" for fact in facts), "dim"))


def estimate(value: float, low: float, high: float) -> str:
    """Format an estimate with its interval, to the digits that the interval allows: "12.3 (11.9–12.8)"."""
    if not high > low:
        return f"{value:.6g}"
    digits = max(0, 1 - math.floor(math.log10(high - low)))
    to = "–" if low >= 0.0 else " to "
    value_text, low_text, high_text = (decimals(each, digits, comma="") for each in (value, low, high))
    return f"{value_text} ({low_text}{to}{high_text})"
