"""Colours of what is drawn beside the entities."""

from __future__ import annotations

from tussle.view.looks import Colour

BACKGROUND: Colour = (255, 255, 255)
"""Of the page, where the mission says nothing."""
GRID_LINE: Colour = (205, 210, 216)
GRID_SECTION: Colour = (165, 172, 182)
REGION: Colour = (120, 130, 145)
"""Of boundaries that are nobody's."""
WALL: Colour = (110, 100, 90)
TERRAIN: Colour = (150, 165, 130)
DRAWN: Colour = (230, 60, 160)
"""Of what plugins draw without saying which colour: none of the teams'."""
LINK: Colour = (90, 140, 160)


def mixed(colour: Colour, other: Colour, share: float) -> Colour:
    """A colour with a share of another, 0 to 1."""
    red, green, blue = (round((1.0 - share) * a + share * b) for a, b in zip(colour, other, strict=True))
    return red, green, blue
