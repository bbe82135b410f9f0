"""Read settings (`--set NAME=VALUE`) and times from the command line."""

from __future__ import annotations

from collections.abc import Iterable

import typer

from tussle.errors import ParameterError
from tussle.mission import Mission
from tussle.units import parse


def read_settings(texts: Iterable[str]) -> dict[str, str]:
    """Parse texts "name=value" into a dict.

    Raises:
        typer.BadParameter: A text has another form, or a name is set twice.
    """
    settings: dict[str, str] = {}
    for text in texts:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not equals or not name:
            raise typer.BadParameter(
                f"{text!r} does not have the form NAME=VALUE, such as prey.Boids.max_speed='50 kt'"
            )
        if name in settings:
            raise typer.BadParameter(f"{name} is set twice, to {settings[name]!r} and to {value!r}")
        settings[name] = value
    return settings


def read_time(option: str, text: str) -> float:
    """Parse the time of an option [s].

    Raises:
        ParameterError: The text is not a time.
    """
    try:
        return parse(text, "s")
    except ParameterError as error:
        raise ParameterError(f"{option}: {error}") from None


def ending_by_time(mission: Mission) -> Mission:
    """Add the end condition "time" to a mission.

    Raises:
        ParameterError: The end is not after the start.
    """
    if not mission.end > mission.start:
        raise ParameterError(
            f"--end {mission.end:g} is not allowed; it takes a time in s > {mission.start:g}, the start"
        )
    return mission.ending_by_time()
