"""The check that values set from outside have an effect: `${cuont}` in a tag that nothing reads would leave all games the same."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from tussle.errors import MissionError, TussleError
from tussle.mission.spec import Mission

if TYPE_CHECKING:
    from tussle.mission.xml import Loaded

PROBE = "\N{REPLACEMENT CHARACTER}"
"""A text that no number, name or choice is written as: whoever reads it either refuses it or has another value than before."""
SHOWN_PLACES = 5


def exactly(mission: Mission) -> str:
    """All of a mission as text, with every digit: `repr` rounds arrays and leaves out the middle of long ones."""
    with np.printoptions(threshold=sys.maxsize, floatmode="unique"):
        return repr(mission)


def check_effects(
    read: Callable[[Mapping[str, Any]], Loaded], loaded: Loaded, settings: Mapping[str, Any]
) -> None:
    """Check that settings have an effect.

    Args:
        read: Reads the mission with other settings.
        loaded: The mission, read with the settings.
        settings: The settings.

    Raises:
        MissionError: Some have no effect; the message says where they stand.
    """
    useless = [
        without_effect(name, loaded) for name in settings if not has_effect(read, loaded, settings, name)
    ]
    if useless:
        raise MissionError("\n".join(useless))


def has_effect(
    read: Callable[[Mapping[str, Any]], Loaded],
    loaded: Loaded,
    settings: Mapping[str, Any],
    name: str,
    *,
    of_game: bool = False,
) -> bool:
    """Return whether the mission depends on a setting: it is read again with a text that no reader accepts.

    Args:
        read: Reads the mission with other settings.
        loaded: The mission, read with the settings.
        settings: The settings.
        name: One of them.
        of_game: The game of a given seed must depend on it, not only the seed, and settings of the viewer and the output.
    """
    try:
        other = read({**settings, name: PROBE})
    except TussleError:
        return True
    others = () if of_game else ("seed", "viewer", "log")
    return exactly(loaded.mission) != exactly(other.mission) or any(
        getattr(loaded, each) != getattr(other, each) for each in others
    )


def without_effect(name: str, loaded: Loaded, on: str = "anything") -> str:
    """The message about a setting that has no effect."""
    if name not in loaded.placeholders:
        return f"{name} has no effect on {on} in this mission"
    places = loaded.placeholder_places[name]
    more = "; ..." if len(places) > SHOWN_PLACES else ""
    return f"{name} has no effect on {on}: ${{{name}}} stands in {'; '.join(places[:SHOWN_PLACES])}{more}"
