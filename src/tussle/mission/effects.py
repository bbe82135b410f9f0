"""The check that values set from outside have an effect: `${cuont}` in a tag that nothing reads would leave all games the same."""

from __future__ import annotations

import dataclasses
import sys
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

import numpy as np

from tussle.errors import MissionError, TussleError
from tussle.mission.spec import Block, Mission

PROBE = "\N{REPLACEMENT CHARACTER}"
"""A text that no number, name or choice is written as: whoever reads it either refuses it or has another value than before."""
SHOWN_PLACES = 5


class _Loaded(Protocol):
    """A mission as read, see `tussle.mission.Loaded`."""

    @property
    def mission(self) -> Mission: ...
    @property
    def placeholders(self) -> Mapping[str, str]: ...
    @property
    def placeholder_places(self) -> Mapping[str, Sequence[str]]: ...


def exactly(mission: Mission) -> str:
    """All of a mission as text, with every digit: `repr` of arrays rounds them and leaves out the middle of long ones."""
    with np.printoptions(threshold=sys.maxsize, floatmode="unique"):
        return _written_out(mission)


def _written_out(value: Any) -> str:
    """`repr` of a value, with all that missions and blocks have."""
    if isinstance(value, (Mission, Block)):
        fields = (
            f"{f.name}={_written_out(getattr(value, f.name))}" for f in dataclasses.fields(value) if f.repr
        )
        return f"{type(value).__name__}({', '.join(fields)})"
    if isinstance(value, tuple) and value and isinstance(value[0], Block):
        return f"({', '.join(map(_written_out, value))}{',' * (len(value) == 1)})"
    return repr(value)


def check_effects(
    read: Callable[[Mapping[str, Any]], _Loaded], loaded: _Loaded, settings: Mapping[str, Any]
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
    read: Callable[[Mapping[str, Any]], _Loaded],
    loaded: _Loaded,
    settings: Mapping[str, Any],
    name: str,
    others: Sequence[Any] = (),
) -> bool:
    """Return whether the mission depends on a setting: it is read again with a text that no reader accepts, or with other values.

    Args:
        read: Reads the mission with other settings.
        loaded: The mission, read with the settings.
        settings: The settings.
        name: One of them.
        others: Other values. If there are any, the game of a given seed must differ with one of them; else it is enough if the seed, or
            settings of the viewer or the output do.
    """
    kept = () if others else ("seed", "viewer", "log")
    return any(_differs(read, loaded, {**settings, name: value}, kept) for value in others or (PROBE,))


def _differs(
    read: Callable[[Mapping[str, Any]], _Loaded],
    loaded: _Loaded,
    settings: Mapping[str, Any],
    kept: Sequence[str],
) -> bool:
    try:
        other = read(settings)
    except TussleError:
        return True
    return exactly(loaded.mission) != exactly(other.mission) or any(
        getattr(loaded, each) != getattr(other, each) for each in kept
    )


def without_effect(name: str, loaded: _Loaded, on: str = "anything") -> str:
    """The message about a setting that has no effect."""
    if name not in loaded.placeholders:
        return f"{name} has no effect on {on} in this mission"
    places = loaded.placeholder_places[name]
    more = "; ..." if len(places) > SHOWN_PLACES else ""
    return f"{name} has no effect on {on}: ${{{name}}} stands in {'; '.join(places[:SHOWN_PLACES])}{more}"
