"""The palette: teams are told apart with every kind of colour vision, and all that draws takes it from one place."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from tussle.palette import GRID, MUTED, NEUTRAL, PAPER, TEAM_COLOURS, colour_of, mixed, rgb_of
from tussle.view.style import Style

# Machado, Oliveira and Fernandes, IEEE TVCG 15 (2009), 1291-1298: linear RGB as seen by dichromats.
VISION = {
    "usual": np.eye(3),
    "protanopia": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "deuteranopia": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
    "tritanopia": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]],
}  # fmt: skip
JUST_SEEN = 2.3
"""Smallest difference in CIELAB that is noticed (Mahy, Van Eycken and Oosterlinck 1994)."""


def lab(colour: str, vision: str) -> np.ndarray:
    """CIELAB of a colour, D65, as it is seen."""
    srgb = np.array(rgb_of(colour)) / 255.0
    linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    linear = np.clip(np.asarray(VISION[vision]) @ linear, 0.0, 1.0)
    to_xyz = [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
    t = np.asarray(to_xyz) @ linear / [0.9505, 1.0, 1.089]
    f = np.where(t > (6 / 29) ** 3, np.cbrt(t), t / (3 * (6 / 29) ** 2) + 4 / 29)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


@pytest.mark.parametrize("vision", VISION)
def test_teams_differ_by_several_times_what_is_just_seen(vision):
    for a, b in itertools.combinations(TEAM_COLOURS, 2):
        assert np.linalg.norm(lab(a, vision) - lab(b, vision)) > 4 * JUST_SEEN


def test_the_viewer_and_the_plots_give_a_team_the_same_colour():
    style = Style([], [])
    assert [style.colour(team) for team in range(1, 9)] == [rgb_of(colour_of(team)) for team in range(1, 9)]
    assert not {GRID, MUTED, PAPER, *NEUTRAL} & set(TEAM_COLOURS)


def test_colours_are_mixed_channel_by_channel():
    assert mixed("#000000", "#ff8000", 0.5) == "#804000"
