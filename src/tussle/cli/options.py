"""Options shared by several commands, and the epilog of all commands."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tussle.cli.terminal import EXIT_CODES

if TYPE_CHECKING:
    from tussle.cli.play import Source

# \b keeps click from rewrapping the lines that follow.
EPILOG = "\b\nExit codes:\n" + "\n".join(f"  {code:>3}  {meaning}" for code, meaning in EXIT_CODES.items())

SET_HELP = (
    "Set a variable ${name=default} of the mission, or any value by its path: prey.Boids.max_speed='50 kt', "
    "prey.motion_model=SimpleAircraft, run.dt=0.05. Can be repeated."
)

MissionName = Annotated[
    str,
    typer.Argument(
        metavar="MISSION",
        help="A mission file, or the name of a built-in mission (tussle missions).",
        show_default=False,
    ),
]
Seed = Annotated[
    int | None,
    typer.Option(
        metavar="N",
        min=0,
        max=2**64 - 1,
        help="Seed of the game; by default that of the mission, or 1.",
        show_default=False,
    ),
]
Set = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="NAME=VALUE",
        help=SET_HELP,
        show_default=False,
    ),
]
More = Annotated[
    list[str] | None, typer.Argument(metavar="NAME=VALUE", help="Same as --set.", show_default=False)
]
End = Annotated[
    str | None,
    typer.Option(metavar="TIME", help="End the game at this time: 60, or '2 min'.", show_default=False),
]
Strict = Annotated[
    bool, typer.Option("--strict", help="Treat unknown tags and attributes of the mission as errors.")
]
PluginFiles = Annotated[
    list[Path] | None,
    typer.Option(
        "--plugin-path",
        metavar="FILE",
        help="A Python file with plugins. Can be repeated.",
        show_default=False,
    ),
]
Large = Annotated[bool, typer.Option("--allow-large", help="Lift the limits on the size of a mission.")]
Debug = Annotated[bool, typer.Option("--debug", help="Show the traceback of an error.")]


def mission_source(
    mission: str,
    settings: list[str] | None,
    more: list[str] | None,
    seed: int | None,
    end: str | None,
    strict: bool,
    plugin_files: list[Path] | None,
    allow_large: bool,
) -> Source:
    """Return the mission selected by the options."""
    from tussle.cli.play import Source
    from tussle.cli.settings import read_settings

    given = read_settings([*(settings or ()), *(more or ())])
    return Source(mission, given, seed, end, strict, tuple(plugin_files or ()), allow_large)
