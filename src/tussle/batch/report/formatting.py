"""Numbers and counts as the report writes them."""

from __future__ import annotations

import math
import re

NARROW = "\u00a0"
"""Keeps a number and its unit on one line."""


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
        mantissa, _, exponent = f"{value:.2e}".partition("e")
        return f"{float(mantissa):g}e{int(exponent)}".replace("-", "−")
    digits = 0 if size >= 100.0 else 2 if value == 0.0 else 2 - math.floor(math.log10(size))
    return f"{value:,.{digits}f}".replace("-", "−")


def interval(low: float, high: float, scale: float = 1.0, unit: str = "") -> str:
    """An interval: "0.12 to 0.34"; "–" where there is none."""
    if not (math.isfinite(low) and math.isfinite(high)):
        return "–"
    return f"{estimate(scale * low)} to {estimate(scale * high)}{unit}"


def percent(share: float, digits: int = 1) -> str:
    """A share in percent: "59.3 %"."""
    return f"{100.0 * share:.{digits}f}{NARROW}%".replace("-", "−") if math.isfinite(share) else "–"


def signed(text: str) -> str:
    """A number with its sign, as differences are written."""
    return text if text.startswith(("−", "–")) or text == "0" else f"+{text}"


def count(n: int, noun: str = "") -> str:
    """A count: "1,000", "1 game", "1,000 games"."""
    return f"{n:,} {noun}{'' if n == 1 else 's'}" if noun else f"{n:,}"


def p_value(p: float) -> str:
    """A probability as tests report it."""
    if not math.isfinite(p):
        return "–"
    return "< 0.001" if p < 0.001 else f"{p:.3f}" if p < 0.1 else f"{p:.2f}"


def seconds(value: float) -> str:
    """A duration: "0.4 s", "12 s", "3.3 min", "5.2 h"."""
    if not math.isfinite(value):
        return "–"
    size, unit = (1.0, "s") if value < 90.0 else (60.0, "min") if value < 5400.0 else (3600.0, "h")
    return f"{value / size:.{1 if value / size < 10.0 else 0}f}{NARROW}{unit}"


def capital(text: str) -> str:
    """A text with a capital."""
    return text[:1].upper() + text[1:]


def sentence(text: str) -> str:
    """A text with a capital and a full stop."""
    text = capital(text.strip())
    return text if text.endswith((".", "!", "?")) else text + "."


def file_name(text: str) -> str:
    """A text as part of a file's name."""
    return re.sub(r"[^A-Za-z0-9]+", "_", text).strip("_")[:40] or "x"
