"""Colours of teams and other elements, used by the viewer, plots and reports."""

from __future__ import annotations

import re
from collections.abc import Iterable

TEAM_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#e69f00", "#56b4e9", "#cc79a7", "#f0e442")
"""Colours of teams 1, 2, ..., repeated. M. Okabe and K. Ito, Color Universal Design (2008): distinguishable with all kinds of colour
vision. Their black is omitted, since it is invisible on a dark background."""

INK, MUTED, GRID, PAPER = "#20252b", "#5f6a76", "#dfe3e8", "#fefefe"
"""Colours of text, of secondary text and marks, of grid lines, and of the background of plots; a page replaces them."""

NEUTRAL = ("#8d97a3", "#4a78a8", "#b5894b")
"""Colours of items without a team, such as ties and end conditions."""

SEQUENTIAL = ("#f7fbd5", "#a1dab4", "#41b6c4", "#2c7fb8", "#253494")
"""Colours from low to high values: ColorBrewer's "YlGnBu", ordered by lightness."""


GREY = "#808080"
DARKEST, BRIGHTEST = 0.05, 0.79
"""Luminance of lines of plots: all of `TEAM_COLOURS` lie between them, and so do pure red, green, blue and cyan."""


def colour_of(team: int) -> str:
    """Colour of a team by its number; `team_colours` gives those of a mission."""
    return TEAM_COLOURS[(team - 1) % len(TEAM_COLOURS)]


def colour_in(text: str) -> str | None:
    """Colour "#rrggbb" that a `<color>` of a mission file names by red, green and blue, 0 to 255; None if it names none."""
    values = [round(float(number)) for number in re.findall(r"-?\d+(?:\.\d+)?", text)]
    if len(values) != 3 or not all(0 <= value <= 255 for value in values):
        return None
    return hex_of(values)


def team_colours(blocks: Iterable[tuple[int, str | None]]) -> dict[int, str]:
    """Colour "#rrggbb" of each team of a mission, in the viewer, films, plots and reports alike.

    A team has the colour of its first block with a `<color>`, else that of its number in the palette, or the next that no other team has.

    Args:
        blocks: Team and text of the `<color>` of each block; None without one.
    """
    found: dict[int, str | None] = {}
    for team, text in blocks:
        found[team] = found.get(team) or (None if text is None else colour_in(text))
    by_team = dict(sorted(found.items()))
    taken = set(by_team.values())
    for team, colour in by_team.items():  # first those that get the colour of their number
        if colour is None and (own := colour_of(team)) not in taken:
            by_team[team] = own
            taken.add(own)
    for team, colour in by_team.items():
        if colour is None:
            order = [colour_of(team + i) for i in range(len(TEAM_COLOURS))]
            by_team[team] = next((each for each in order if each not in taken), order[0])
            taken.add(by_team[team])
    return {team: colour for team, colour in by_team.items() if colour}


def on_paper(colour: str) -> str:
    """A colour for lines of a plot, which a page shows on white or on black: one too bright or too dark for that is mixed with grey."""
    share = next(
        s for s in (0.01 * k for k in range(101)) if DARKEST <= luminance(mixed(colour, GREY, s)) <= BRIGHTEST
    )
    return mixed(colour, GREY, share)


def luminance(colour: str) -> float:
    """Relative luminance of a colour, 0 to 1 (Web Content Accessibility Guidelines 2.2, section "relative luminance")."""
    linear = (
        c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4
        for c in (v / 255.0 for v in rgb_of(colour))
    )
    return sum(weight * part for weight, part in zip((0.2126, 0.7152, 0.0722), linear, strict=True))


def rgb_of(colour: str) -> tuple[int, int, int]:
    """Convert a colour "#rrggbb" to red, green and blue, 0 to 255."""
    red, green, blue = bytes.fromhex(colour[1:])
    return red, green, blue


def hex_of(rgb: Iterable[int]) -> str:
    """Convert red, green and blue, 0 to 255, to a colour "#rrggbb"."""
    return "#" + bytes(rgb).hex()


def mixed(colour: str, other: str, share: float) -> str:
    """Mix a colour with a share of another."""
    pairs = zip(rgb_of(colour), rgb_of(other), strict=True)
    return hex_of(round(a + (b - a) * share) for a, b in pairs)
