"""The commands that a browser may send, with their fields and allowed values."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from tussle.errors import ParameterError
from tussle.view.live import Live

MAX_COORDINATE = 1e12
"""Largest coordinate [m] and time [s] in a command."""
MAX_ID = 2**31 - 1
REACH = 1e3
"""Largest distance of a point of the world, in sizes of the scene."""
MAX_WANTED = 64
"""Quantities of the curves that one browser can choose."""
CUSTOM_KEY = ";"
"""The key that is kept for the plugins, as in SCRIMMAGE."""
SHOWN = 40
"""Characters of a refused value in the words about it."""


@dataclass(frozen=True)
class Check:
    """Checks the value of a field.

    Attributes:
        holds: Whether a value is one of them.
        allowed: They in words.
    """

    holds: Callable[[Any], bool]
    allowed: str


def number(low: float = -MAX_COORDINATE, high: float = MAX_COORDINATE) -> Check:
    """Return a check for a number in a range; NaN is never allowed."""
    return Check(
        lambda value: type(value) in (int, float) and low <= value <= high,
        f"a number from {low:g} to {high:g}",
    )


def whole(low: int, high: int) -> Check:
    """Return a check for an integer in a range."""
    return Check(
        lambda value: type(value) is int and low <= value <= high, f"a whole number from {low} to {high}"
    )


WHO = whole(0, MAX_ID)
POINT = Check(
    lambda value: isinstance(value, list) and len(value) == 3 and all(map(number().holds, value)),
    "x, y, z in m",
)
WANTED = Check(
    lambda value: (
        isinstance(value, list)
        and len(value) <= MAX_WANTED
        and all(
            isinstance(v, list) and len(v) == 2 and isinstance(v[0], str) and WHO.holds(v[1]) for v in value
        )
    ),
    f"at most {MAX_WANTED} pairs of a name and an id",
)
KEY = Check(lambda value: value == CUSTOM_KEY, f"the key {CUSTOM_KEY}")
WARP = Check(
    lambda value: value is None or number(1e-6, 1e6).holds(value), "a number from 1e-06 to 1e+06, or null"
)


@dataclass(frozen=True)
class Command:
    """A command of the page.

    Attributes:
        do: Does it, called with the fields by name.
        fields: Name -> what it takes; all of them are needed.
        steers: It changes the game or its time, and not only what this browser sees.
    """

    do: Callable[..., None]
    fields: Mapping[str, Check] = field(default_factory=dict)
    steers: bool = True


def game_commands(live: Live) -> dict[str, Command]:
    """Return the commands of a live game by name."""

    def seek(t: float) -> None:
        first, last = live.span
        live.seek(min(max(t, first), last))

    def warp(value: float | None) -> None:
        live.warp = value

    def point(pos: list[float]) -> None:
        if max(map(abs, pos)) > REACH * live.scenery.size:
            raise ParameterError("there is no ground there")
        live.publish_click(pos)

    return {
        "pause": Command(live.pause),
        "resume": Command(live.resume),
        "step": Command(live.step, {"n": whole(-1000, 1000)}),
        "seek": Command(seek, {"t": number()}),
        "warp": Command(warp, {"value": WARP}),
        "faster": Command(live.faster),
        "slower": Command(live.slower),
        "reset": Command(live.reset, {"seed": whole(0, MAX_ID)}),
        "point": Command(point, {"pos": POINT}),
        "key": Command(live.publish_key, {"key": KEY}),
    }


def read_command(text: Any, commands: Mapping[str, Command]) -> tuple[str, dict[str, Any]] | None:
    """Return name and fields of a valid command; None for anything else.

    Args:
        text: What a browser has sent.
        commands: Those that there are.

    Raises:
        ParameterError: A field's value is not allowed.
    """
    try:
        given = json.loads(text, parse_constant=lambda _: math.nan) if isinstance(text, str) else None
    except (ValueError, RecursionError):
        return None
    if not isinstance(given, dict):
        return None
    name = given.pop("do", None)
    command = commands.get(name) if isinstance(name, str) else None
    if command is None or given.keys() != command.fields.keys():
        return None
    for key, check in command.fields.items():
        if not check.holds(given[key]):
            shown = repr(given[key])
            shown = shown if len(shown) <= SHOWN else f"{shown[:SHOWN]} …"
            raise ParameterError(f"{key} = {shown} is not allowed; it takes {check.allowed}")
    return name, given
