"""The commands that a browser may send, with their fields and allowed values."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from tussle.documents import Checked, Either, Map, Maybe, Real, Rule, Whole, check_argument, problem
from tussle.engine.manual import AXES
from tussle.errors import ParameterError
from tussle.view.live import Live

MAX_COORDINATE = 1e12
"""Largest coordinate [m] and time [s] in a command."""
MAX_ID = 2**31 - 1
REACH = 1e3
"""Largest distance of a point of the world, in sizes of the scene."""
MAX_WANTED = 64
"""Quantities of the curves that one browser can choose."""
MAX_RECEIVERS = 1000
"""Entities that one order is for."""
CUSTOM_KEY = ";"
"""The key that is kept for the plugins, as in SCRIMMAGE."""


COORDINATE, ID = Real(-MAX_COORDINATE, MAX_COORDINATE), Whole(0, MAX_ID)


def _point_problem(value: list[Any], _: str) -> str:
    return "" if len(value) == 3 else "it has not three numbers"


def _ids_problem(value: list[Any], _: str) -> str:
    return "" if 1 <= len(value) <= MAX_RECEIVERS else "it has none, or too many"


def _wanted_problem(value: list[Any], _: str) -> str:
    is_good = len(value) <= MAX_WANTED and all(
        len(pair) == 2 and not problem(pair[0], str) and not problem(pair[1], ID) for pair in value
    )
    return "" if is_good else "it has too many, or no pairs"


POINT = Either((Checked([COORDINATE], _point_problem),), "x, y, z in m")
PAIRS = [Either((str, ID), "a name and an id")]
WANTED = Either((Checked([PAIRS], _wanted_problem),), f"at most {MAX_WANTED} pairs of a name and an id")


def _sticks_problem(value: list[Any], _: str) -> str:
    return "" if len(value) == len(AXES) else "it has not three numbers"


STICKS = Either(
    (Maybe(Checked([Real(-1.0, 1.0)], _sticks_problem)),), "ahead, left, up from -1 to 1, or null"
)
IDS = Either((Checked([Whole(1, MAX_ID)], _ids_problem),), f"1 to {MAX_RECEIVERS} ids")
TYPED = Map(
    Either((Real(), bool, str, [Either((Real(), bool, [Real()]), "numbers")]), "a number, a text or a list")
)
KEY = Either(((CUSTOM_KEY,),), f"the key {CUSTOM_KEY}")
WARP = Either((Maybe(Real(1e-6, 1e6)),), "a number from 1e-06 to 1e+06, or null")


@dataclass(frozen=True)
class Command:
    """A command of the page.

    Attributes:
        do: Does it, called with the fields by name.
        fields: Name -> what it takes; all of them are needed.
        steers: It changes the game or its time, and not only what this browser sees.
        receivers: Name of the field with the ids of the entities that it is for; operators may give it to those of their team.
    """

    do: Callable[..., None]
    fields: Mapping[str, Rule] = field(default_factory=dict)
    steers: bool = True
    receivers: str = ""


def game_commands(live: Live) -> dict[str, Command]:
    """Return the commands of a live game by name."""

    def seek(t: float) -> None:
        first, last = live.span
        live.seek(min(max(t, first), last))

    def warp(value: float | None) -> None:
        live.warp = value

    def near(pos: list[float]) -> list[float]:
        if max(map(abs, pos)) > REACH * live.scenery.size:
            raise ParameterError("there is no ground there")
        return pos

    return {
        "pause": Command(live.pause),
        "resume": Command(live.resume),
        "step": Command(live.step, {"n": Whole(-1000, 1000)}),
        "seek": Command(seek, {"t": COORDINATE}),
        "warp": Command(warp, {"value": WARP}),
        "faster": Command(live.faster),
        "slower": Command(live.slower),
        "reset": Command(live.reset, {"seed": ID}),
        "point": Command(lambda pos: live.publish_click(near(pos)), {"pos": POINT}),
        "key": Command(live.publish_key, {"key": KEY}),
        "order": Command(
            live.order,
            {"receivers": IDS, "network": str, "topic": str, "values": TYPED},
            receivers="receivers",
        ),
        "set": Command(
            live.set_parameter, {"entities": IDS, "path": str, "value": TYPED.rule}, receivers="entities"
        ),
        "spawn": Command(lambda block, pos: live.spawn(block, near(pos)), {"block": str, "pos": POINT}),
        "remove": Command(live.remove, {"entities": IDS}, receivers="entities"),
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
    for key, rule in command.fields.items():
        check_argument(key, given[key], rule)
    return name, given
