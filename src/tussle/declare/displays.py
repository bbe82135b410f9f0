"""How objects show themselves: one line in a terminal, and a small piece of HTML in a notebook.

Whatever is shown, the HTML is escaped, uses the colours of the page that it is in, and is below `MAX_HTML` characters.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from html import escape
from itertools import islice
from typing import Any

MAX_HTML = 50_000
MAX_TABLE = 20_000
"""Characters of the rows of all tables of an object."""
MAX_WORD, MAX_LINE = 60, 200
MAX_LISTED = 6
"""Items that a line lists."""
MAX_COLUMNS = 12
WHOLE = 1e9
"""Real numbers below it are written without an exponent."""
MAX_DECIMALS, MAX_WRITTEN_OUT = 9, 1e15
"""Decimals, and size, of numbers in tables that have no exponent."""
CELL = 'style="padding:1px 10px 1px 0;text-align:left;vertical-align:top"'


def shortened(value: Any, most: int = MAX_WORD) -> str:
    """Return a value as text on one line, without characters that cannot be printed, of at most `most` characters."""
    text = " ".join(str(value)[: 4 * most].split())
    text = "".join(letter if letter.isprintable() else "\N{REPLACEMENT CHARACTER}" for letter in text)
    return text if len(text) <= most else text[: most - 1] + "…"


def listing(items: Sequence[Any]) -> str:
    """Return items separated by commas; of many, the first ones and their number."""
    first = ", ".join(shortened(item, MAX_LINE // MAX_LISTED) for item in islice(items, MAX_LISTED))
    return first if len(items) <= MAX_LISTED else f"{first}, … ({len(items):,})"


def line(kind: str, name: str, *facts: str) -> str:
    """Return the `repr` of an object that is not written as code: "<Simulation 'flock': 2 worlds, t = 3 s>"."""
    said = ", ".join(shortened(fact, MAX_LINE) for fact in facts if fact)
    return f"<{' '.join(part for part in (kind, shortened(name, MAX_LINE)) if part)}{': ' if said else ''}{said}>"


def counted(n: int, noun: str, plural: str = "") -> str:
    """Return a number with its noun: "1 world", "2 worlds"."""
    return f"{n:,} {noun if n == 1 else plural or f'{noun}s'}"


def number(value: Any, digits: int = 6) -> str:
    """Return a real number with so many digits at most, and commas between thousands; anything else as text.

    Terminal, pages and reports write "0.1235", "12,345.6" and "1.2e-7", and a number of more digits than that whole: "1,234,568".
    """
    if not isinstance(value, float):
        return str(value)
    if 10.0**digits <= abs(value) < WHOLE:
        return f"{value:,.0f}"
    mantissa, _, exponent = f"{value:,.{digits}g}".partition("e")
    return f"{mantissa}e{int(exponent)}" if exponent else mantissa


def decimals(value: float, digits: int, sign: str = "", comma: str = ",") -> str:
    """Return a number to so many decimals: "1,234.50"; where that takes more than nine, or from 10^15 on, "1.25e-11", to the same place."""
    if value == 0.0 or not math.isfinite(value) or (digits <= MAX_DECIMALS and abs(value) < MAX_WRITTEN_OUT):
        return f"{value:{sign}z{comma}.{min(max(digits, 0), MAX_DECIMALS)}f}"
    figures = min(max(math.floor(math.log10(abs(value))) + digits, 0), 15)
    mantissa, _, exponent = f"{value:{sign}.{figures}e}".partition("e")
    return f"{mantissa}e{int(exponent)}"


def table(head: Sequence[str], rows: Iterable[Sequence[Any]], room: int = MAX_TABLE) -> str:
    """Return a table as HTML. Rows that need more than `room` characters, and columns beyond `MAX_COLUMNS`, are left out, which it says."""
    wide = len(head) > MAX_COLUMNS
    parts, used, n_left_out = [_row("th", head)], 0, 0
    for row in rows:
        text = _row("td", row) if not n_left_out else ""
        if n_left_out or used + len(text) > room:
            n_left_out += 1
            continue
        parts.append(text)
        used += len(text)
    notes = [f"… and {counted(n_left_out, 'more row')}"] if n_left_out else []
    notes += [f"… and {counted(len(head) - MAX_COLUMNS, 'more column')}"] if wide else []
    below = "".join(f"<div>{note}</div>" for note in notes)
    return f'<table style="border-collapse:collapse;background:none">{"".join(parts)}</table>{below}'


def _row(tag: str, cells: Sequence[Any]) -> str:
    inner = "".join(
        f"<{tag} {CELL}>{escape(shortened(number(cell)))}</{tag}>" for cell in cells[:MAX_COLUMNS]
    )
    return f'<tr style="background:none">{inner}</tr>'


def page(title: str, facts: Sequence[str], *parts: str) -> str:
    """Return the HTML of an object: a title, a line of facts, and parts that are HTML already.

    Parts for which there is no room are left out.
    """
    head = f"<strong>{escape(shortened(title, MAX_LINE))}</strong>"
    about = escape(" · ".join(shortened(fact, MAX_LINE) for fact in facts[:MAX_COLUMNS] if fact))
    room = MAX_HTML - len(head) - len(about) - 500
    shown = []
    for part in parts:
        if len(part) <= room:
            shown.append(part)
            room -= len(part)
    return (
        '<div style="font-family:system-ui,sans-serif;font-size:13px;line-height:1.4;color:inherit">'
        f'{head}<div style="opacity:.75;margin-bottom:4px">{about}</div>{"".join(shown)}</div>'
    )
