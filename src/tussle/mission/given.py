"""What functions that play, show or write a mission take: a mission, the name of one that ships, or a file."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeAlias

from tussle.errors import MissionError
from tussle.mission.spec import Mission
from tussle.mission.xml import Loaded, read_mission

GivenMission: TypeAlias = Mission | str | Path


def mission_of(
    given: GivenMission, taker: str, overrides: Mapping[str, Any] | None = None
) -> tuple[Mission, int | None]:
    """Return the mission and the seed of its file, None without one. Notes on the file are warnings.

    Args:
        given: A mission, the name of a shipped mission ("predator_prey") or of a stock plugin (its example), or a mission file.
        taker: What takes it, for errors.
        overrides: Values of the mission; as for `read_mission`. Not for a mission made in Python.

    Raises:
        MissionError: It is none of these, or the file cannot be read or is invalid.
    """
    if isinstance(given, Mission):
        return given, None
    if not isinstance(given, (str, Path)):
        raise MissionError(f"{taker} needs {wanted(given)}")
    loaded = read_mission(given, overrides)
    for note in loaded.game_notes:
        warnings.warn(note, RuntimeWarning, stacklevel=3)
    return loaded.mission, loaded.seed


def wanted(given: Any) -> str:
    """What is needed in place of something that is no mission, for errors."""
    if isinstance(given, Loaded):
        return f"a Mission, not a Loaded: it is in the attribute `mission` of what read_mission returned for {given.path}"
    return f"a Mission, the name of one that ships, or a mission file, not {given!r:.200}"
