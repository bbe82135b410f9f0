"""The colours of tussle: the same teams have the same colours in the viewer, in plots and in reports."""

from __future__ import annotations

TEAM_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#e69f00", "#56b4e9", "#cc79a7", "#f0e442")
"""Of teams 1, 2, ..., and again from the first. M. Okabe and K. Ito, Color Universal Design (2008): told apart with every kind of
colour vision. Their black is left out, which is lost on a dark background."""

INK, MUTED, GRID, PAPER = "#20252b", "#5f6a76", "#dfe3e8", "#fefefe"
"""Of text, of secondary text and marks, of grid lines, of the background of plots; a page puts its own in their place."""

NEUTRAL = ("#8d97a3", "#4a78a8", "#b5894b")
"""Of what belongs to no team, such as ties and ways in which games end."""

SEQUENTIAL = ("#f7fbd5", "#a1dab4", "#41b6c4", "#2c7fb8", "#253494")
"""From little to much: ColorBrewer's "YlGnBu", which is read by its lightness."""


def colour_of(team: int) -> str:
    """The colour of a team."""
    return TEAM_COLOURS[(team - 1) % len(TEAM_COLOURS)]


def rgb_of(colour: str) -> tuple[int, int, int]:
    """A colour "#rrggbb" as red, green and blue, 0 to 255."""
    red, green, blue = bytes.fromhex(colour[1:])
    return red, green, blue


def mixed(colour: str, other: str, share: float) -> str:
    """A colour with a share of another in it."""
    pairs = zip(rgb_of(colour), rgb_of(other), strict=True)
    return "#" + "".join(f"{round(a + (b - a) * share):02x}" for a, b in pairs)
