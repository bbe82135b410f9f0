"""`--set name=value` and times: what the command line changes in a mission."""

from __future__ import annotations

from collections.abc import Iterable

import typer

from tussle.errors import ParameterError
from tussle.mission import Mission
from tussle.units import parse


def read_settings(texts: Iterable[str]) -> dict[str, str]:
    """Texts "name=value" as a dict.

    Raises:
        typer.BadParameter: One is written otherwise, or a name stands twice.
    """
    settings: dict[str, str] = {}
    for text in texts:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not equals or not name:
            raise typer.BadParameter(
                f"{text!r} is not written as NAME=VALUE, such as prey.Boids.max_speed='50 kt'"
            )
        if name in settings:
            raise typer.BadParameter(f"{name} is set twice, to {settings[name]!r} and to {value!r}")
        settings[name] = value
    return settings


def read_time(option: str, text: str) -> float:
    """The time of an option [s].

    Raises:
        ParameterError: It is no time.
    """
    try:
        return parse(text, "s")
    except ParameterError as error:
        raise ParameterError(f"{option}: {error}") from None


def ending_by_time(mission: Mission) -> Mission:
    """The mission with the condition "time" among those that end it.

    Raises:
        ParameterError: Its end is not after its start.
    """
    if not mission.end > mission.start:
        raise ParameterError(
            f"--end {mission.end:g} is not allowed; it takes a time in s > {mission.start:g}, the start"
        )
    return mission.ending_by_time()
