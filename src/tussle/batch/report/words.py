"""Numbers and counts as sentences write them."""

from __future__ import annotations

import math
import re

NARROW = "\u00a0"
"""Stands between a number and its unit, and keeps them in one line."""


def number(value: float) -> str:
    """A number with the digits that count: "0.0421", "12.3", "1,234", "9" where it is 9 exactly; "–" where there is none."""
    is_whole = math.isfinite(value) and float(value).is_integer() and abs(value) < 1e7
    return f"{value:,.0f}".replace("-", "−") if is_whole else estimate(value)


def estimate(value: float) -> str:
    """A number of which three digits are known: "0.0421", "9.00", "12.3", "1,234"."""
    if not math.isfinite(value):
        return "–"
    size = abs(value)
    if size >= 1e7 or 0.0 < size < 1e-4:
        return f"{value:.3g}".replace("e+0", "e").replace("e+", "e").replace("e-0", "e-").replace("-", "−")
    digits = 0 if size >= 100.0 else 2 if value == 0.0 else 2 - math.floor(math.log10(size))
    return f"{value:,.{digits}f}".replace("-", "−")


def percent(share: float, digits: int = 1) -> str:
    """A share in percent: "59.3 %"."""
    return f"{100.0 * share:.{digits}f}{NARROW}%".replace("-", "−") if math.isfinite(share) else "–"


def signed(text: str) -> str:
    """A number with its sign, as differences are written."""
    return text if text.startswith(("−", "–")) or text == "0" else f"+{text}"


def count(n: int, one: str = "", many: str = "") -> str:
    """How many there are: "1,000", "1 game", "1,000 games"."""
    if not one:
        return f"{n:,}"
    return f"{n:,} {one if n == 1 else many or one + 's'}"


def p_value(p: float) -> str:
    """A probability as tests report it."""
    if not math.isfinite(p):
        return "–"
    return "< 0.001" if p < 0.001 else f"{p:.3f}" if p < 0.1 else f"{p:.2f}"


def seconds(value: float) -> str:
    """A duration: "0.4 s", "12 s", "3 min", "5.2 h"."""
    if not math.isfinite(value):
        return "–"
    for limit, size, unit in ((90.0, 1.0, "s"), (5400.0, 60.0, "min"), (float("inf"), 3600.0, "h")):
        if value < limit:
            return f"{value / size:.{1 if value / size < 10.0 else 0}f}{NARROW}{unit}"
    raise AssertionError(value)


def capital(text: str) -> str:
    """A text as a heading begins."""
    return text[:1].upper() + text[1:]


def sentence(text: str) -> str:
    """A text with a capital and a full stop."""
    text = capital(text.strip())
    return text if text.endswith((".", "!", "?")) else text + "."


def file_name(text: str) -> str:
    """A text as part of a file's name."""
    return re.sub(r"[^A-Za-z0-9]+", "_", text).strip("_")[:40] or "x"
