"""`tussle plot RUN`: plot a recorded run."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer

from tussle.cli.options import Debug, PluginFiles
from tussle.cli.terminal import out, reported, say_note

PLOTS = "plots"
"""Folder of the plots in the run directory."""

RunName = Annotated[
    Path, typer.Argument(metavar="RUN", help="A run directory, complete or not.", show_default=False)
]
Kinds = Annotated[
    list[str] | None,
    typer.Option(
        "--kind",
        metavar="KIND",
        help="trajectory, trajectory3d, speed, altitude, left, captures, density or distance; by default all that have data. "
        "Can be repeated.",
        show_default=False,
    ),
]
Between = Annotated[
    tuple[int, int] | None,
    typer.Option(metavar="ID ID", help="Plot the distance between these two entities.", show_default=False),
]
Teams = Annotated[
    list[int] | None,
    typer.Option("--team", metavar="N", help="Only this team. Can be repeated.", show_default=False),
]
Entities = Annotated[
    list[int] | None,
    typer.Option("--entity", metavar="ID", help="Only this entity. Can be repeated.", show_default=False),
]
Start = Annotated[
    str | None,
    typer.Option("--from", metavar="TIME", help="Start at this time: 60, or '2 min'.", show_default=False),
]
End = Annotated[
    str | None, typer.Option("--to", metavar="TIME", help="End at this time.", show_default=False)
]
Directory = Annotated[
    Path | None,
    typer.Option(
        "--out", metavar="DIR", help="Directory for the plots; by default RUN/plots.", show_default=False
    ),
]


def plot(
    run: RunName,
    kinds: Kinds = None,
    between: Between = None,
    teams: Teams = None,
    entities: Entities = None,
    start: Start = None,
    end: End = None,
    world: Annotated[int, typer.Option(metavar="N", min=0, help="World of a stack.")] = 0,
    form: Annotated[str, typer.Option("--format", metavar="png|svg|pdf", help="File format.")] = "png",
    directory: Directory = None,
    plugin_files: PluginFiles = None,
    debug: Debug = False,
) -> None:
    """Plot a recorded run: trajectories, speed, altitude, entities left, captures, density."""
    with reported(debug):
        from tussle.cli.progress import home_short
        from tussle.cli.settings import read_time
        from tussle.view.plots import Choice, write_plots
        from tussle.view.recording import Recording

        first = -math.inf if start is None else read_time("--from", start)
        last = math.inf if end is None else read_time("--to", end)
        choice = Choice(tuple(teams or ()), tuple(entities or ()), first, last)
        recording = Recording(run, world, tuple(plugin_files or ()))
        written = write_plots(recording, directory or run / PLOTS, kinds or (), choice, between, form)
        for note in written.notes:
            say_note(note)
        for file in written.files:
            out().print(home_short(file), soft_wrap=True)
