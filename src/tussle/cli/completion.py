"""What the shell offers for words of the command line: missions, plugins, and settings by their paths."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

if TYPE_CHECKING:
    from tussle.mission import Loaded

ONE_WORD = re.compile(r"[\w.+-]+", re.ASCII)
"""Values that a shell takes without quotes."""


def missions(incomplete: str) -> list[str]:
    """Names of shipped missions, and of plugins for their examples, that begin so; the shell adds files where there are none."""
    from tussle.mission import shipped_missions
    from tussle.plugins import stock

    return beginning(
        incomplete, [*shipped_missions(), *(stock.examples() if incomplete[:1].isupper() else ())]
    )


def plugins(incomplete: str) -> list[str]:
    """Names of shipped missions and of stock plugins that begin so."""
    return sorted({*missions(incomplete), *stock_plugins(incomplete)})


def stock_plugins(incomplete: str) -> list[str]:
    """Names of stock plugins that begin so."""
    from tussle.plugins import stock

    return beginning(incomplete, stock.manifest())


def settings(ctx: typer.Context, incomplete: str) -> list[str]:
    """Settings NAME=VALUE of the mission of the command line that begin so, with their present values."""
    from tussle.errors import TussleError
    from tussle.mission import read_mission

    mission, files = ctx.params.get("mission"), ctx.params.get("plugin_files")
    try:
        loaded = read_mission(mission or "", plugin_files=tuple(map(Path, files or ())), plays=False)
    except TussleError:  # the command itself reports it
        return []
    return beginning(incomplete, all_settings(loaded))


def beginning(incomplete: str, words: Iterable[str]) -> list[str]:
    """The words that begin so, sorted."""
    return sorted({word for word in words if word.startswith(incomplete)})


def all_settings(loaded: Loaded) -> Iterator[str]:
    """All that `--set` can set in a mission: NAME=VALUE with the present value where that is one word, else NAME."""
    from tussle.mission.paths import MissionRoot, inside

    for name, value in loaded.placeholders.items():
        yield _setting(name, value)
    for name, owner in inside(MissionRoot(loaded.mission)).items():
        yield from _below(name, owner)


def _below(path: str, owner: Any) -> Iterator[str]:
    from tussle.api.plugin import Plugin
    from tussle.errors import ParameterError
    from tussle.mission.codecs import written
    from tussle.mission.paths import inside
    from tussle.mission.spec import Mission
    from tussle.mission.tags import ENTITY, RUN

    if isinstance(owner, Plugin):
        for name, param in owner.params().items():
            try:
                yield _setting(f"{path}.{name}", written(owner.values[name], param.units, param.text_units))
            except ParameterError:  # not a value that a file can hold
                yield f"{path}.{name}"
    else:
        yield from (f"{path}.{tag}" for tag in (RUN if isinstance(owner, Mission) else ENTITY))
    for name, member in inside(owner).items():
        yield from _below(f"{path}.{name}", member)


def _setting(name: str, value: str) -> str:
    return f"{name}={value}" if ONE_WORD.fullmatch(value) else name
