"""Colours of teams and other elements, used by the viewer, plots and reports."""

from __future__ import annotations

TEAM_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#e69f00", "#56b4e9", "#cc79a7", "#f0e442")
"""Colours of teams 1, 2, ..., repeated. M. Okabe and K. Ito, Color Universal Design (2008): distinguishable with all kinds of colour
vision. Their black is omitted, since it is invisible on a dark background."""

INK, MUTED, GRID, PAPER = "#20252b", "#5f6a76", "#dfe3e8", "#fefefe"
"""Colours of text, of secondary text and marks, of grid lines, and of the background of plots; a page replaces them."""

NEUTRAL = ("#8d97a3", "#4a78a8", "#b5894b")
"""Colours of items without a team, such as ties and end conditions."""

SEQUENTIAL = ("#f7fbd5", "#a1dab4", "#41b6c4", "#2c7fb8", "#253494")
"""Colours from low to high values: ColorBrewer's "YlGnBu", ordered by lightness."""


def colour_of(team: int) -> str:
    """Colour of a team."""
    return TEAM_COLOURS[(team - 1) % len(TEAM_COLOURS)]


def rgb_of(colour: str) -> tuple[int, int, int]:
    """Convert a colour "#rrggbb" to red, green and blue, 0 to 255."""
    red, green, blue = bytes.fromhex(colour[1:])
    return red, green, blue


def mixed(colour: str, other: str, share: float) -> str:
    """Mix a colour with a share of another."""
    pairs = zip(rgb_of(colour), rgb_of(other), strict=True)
    return "#" + "".join(f"{round(a + (b - a) * share):02x}" for a, b in pairs)
