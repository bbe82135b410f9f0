"""`tussle export RUN`: a recorded run as a page, a film, a picture, or tables for other tools."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import typer
from typer.core import TyperCommand

from tussle.cli.options import Debug, PluginFiles
from tussle.cli.terminal import told

DEFAULT_NAMES = {
    "html": "replay.html",
    "mp4": "film.mp4",
    "gif": "film.gif",
    "png": "picture.png",
    "mcap": "run.mcap",
    "csv": "states.csv",
    "parquet": "states.parquet",
}
"""Outputs, and the files in the run directory that they go to when none is named."""
BESIDE = "@"
"""Stands on the command line, put there by `ExportCommand`, for the file in the run directory."""
FILMS = ("mp4", "gif", "png")


class ExportCommand(TyperCommand):
    """The command, whose outputs need no file name: `tussle export RUN --mp4 --gif small.gif`."""

    def parse_args(self, ctx: typer.Context, args: list[str]) -> list[str]:  # type: ignore[override]
        """Give those outputs a name that stand at the end or before another option."""
        options = {f"--{name}" for name in DEFAULT_NAMES}
        whole: list[str] = []
        for word, following in zip(args, [*args[1:], "--"], strict=True):
            whole.append(word)
            if word in options and following.startswith("-"):
                whole.append(BESIDE)
        return super().parse_args(ctx, whole)


def _output(name: str, what: str) -> object:
    return typer.Option(
        f"--{name}",
        metavar="[FILE]",
        help=f"{what} By default RUN/{DEFAULT_NAMES[name]}.",
        show_default=False,
    )


RunName = Annotated[
    Path, typer.Argument(metavar="RUN", help="A run directory, finished or not.", show_default=False)
]
Html = Annotated[Path | None, _output("html", "A page that plays it offline.")]
Mp4 = Annotated[Path | None, _output("mp4", "A film in H.264.")]
Gif = Annotated[Path | None, _output("gif", "A small film for places that take only pictures.")]
Png = Annotated[Path | None, _output("png", "One picture.")]
Mcap = Annotated[Path | None, _output("mcap", "A log that Foxglove opens.")]
Csv = Annotated[Path | None, _output("csv", "States, and events beside them.")]
Parquet = Annotated[Path | None, _output("parquet", "The same, compressed.")]
World = Annotated[
    int | None,
    typer.Option(
        metavar="N", min=0, help="World of a stack; by default 0, and all for tables.", show_default=False
    ),
]
CameraName = Annotated[
    str | None,
    typer.Option(
        "--camera",
        metavar="overview|top|follow",
        help="Of films and pictures: all from the south, all from above, or behind one entity; by default overview.",
        show_default=False,
    ),
]
FollowId = Annotated[
    int | None, typer.Option("--follow", metavar="ID", help="Fly behind this entity.", show_default=False)
]
Start = Annotated[
    str | None,
    typer.Option(
        "--from", metavar="TIME", help="A film begins at this time: 60, or '2 min'.", show_default=False
    ),
]
Stop = Annotated[
    str | None, typer.Option("--to", metavar="TIME", help="It ends at this time.", show_default=False)
]
At = Annotated[
    str | None,
    typer.Option(
        "--at", metavar="TIME", help="Time of the picture; by default the middle.", show_default=False
    ),
]
Speed = Annotated[
    float | None,
    typer.Option(
        metavar="X",
        help="Simulated seconds per second of film; by default so many that it lasts half a minute or less.",
        show_default=False,
    ),
]
Fps = Annotated[
    float | None, typer.Option(metavar="N", help="Pictures per second; by default 25.", show_default=False)
]
Size = Annotated[
    str | None,
    typer.Option(
        metavar="WIDTHxHEIGHT", help="Of films and pictures; by default 1280x720.", show_default=False
    ),
]
Trails = Annotated[
    float | None,
    typer.Option(metavar="S", help="How much of the past trails show [s]; 0 for none.", show_default=False),
]
Labels = Annotated[bool, typer.Option("--labels", help="Write ids beside the entities.")]
NoCaption = Annotated[bool, typer.Option("--no-caption", help="Write nothing on films and pictures.")]
Zoom = Annotated[
    float | None, typer.Option(metavar="X", help="So much nearer than it would be.", show_default=False)
]
Scale = Annotated[
    float | None,
    typer.Option(metavar="X", help="Models so much larger than they would be.", show_default=False),
]
Period = Annotated[
    float | None,
    typer.Option(
        metavar="S",
        help="Time between the states that --html and --mcap keep [s]; by default all.",
        show_default=False,
    ),
]


def export(
    run: RunName,
    html: Html = None,
    mp4: Mp4 = None,
    gif: Gif = None,
    png: Png = None,
    mcap: Mcap = None,
    csv: Csv = None,
    parquet: Parquet = None,
    world: World = None,
    camera: CameraName = None,
    follow: FollowId = None,
    start: Start = None,
    stop: Stop = None,
    at: At = None,
    speed: Speed = None,
    fps: Fps = None,
    size: Size = None,
    trails: Trails = None,
    labels: Labels = False,
    no_caption: NoCaption = False,
    zoom: Zoom = None,
    scale: Scale = None,
    period: Period = None,
    plugin_files: PluginFiles = None,
    debug: Debug = False,
) -> None:
    """Make a page, a film, a picture or tables of a recorded run; several at once if you like."""
    asked = {"html": html, "mp4": mp4, "gif": gif, "png": png, "mcap": mcap, "csv": csv, "parquet": parquet}
    files = {
        name: run / DEFAULT_NAMES[name] if str(file) == BESIDE else file
        for name, file in asked.items()
        if file is not None
    }
    if not files:
        names = ", ".join(f"--{name}" for name in asked)
        raise typer.BadParameter(f"nothing is asked for; there are: {names}")
    look = {
        "--camera": camera, "--follow": follow, "--from": start, "--to": stop, "--speed": speed, "--fps": fps, "--size": size,
        "--trails": trails, "--labels": labels or None, "--no-caption": no_caption or None, "--zoom": zoom,
    }  # fmt: skip
    _refuse_idle(look, FILMS, files)
    _refuse_idle({"--speed": speed, "--fps": fps}, ("mp4", "gif"), files)
    _refuse_idle({"--at": at}, ("png",), files)
    _refuse_idle({"--scale": scale}, (*FILMS, "mcap"), files)
    _refuse_idle({"--period": period}, ("html", "mcap"), files)
    if period is not None and not 0.0 < period < float("inf"):
        raise typer.BadParameter(f"--period {period:g} is not allowed; it takes a number > 0")
    with told(debug):
        from tussle.cli.exporting import Source, film_options, write_outputs

        options = film_options(
            camera=camera or ("overview" if follow is None else "follow"), follow=follow, start=start, stop=stop, at=at,
            speed=speed, fps=fps, size=size, trails=trails, labels=labels, captions=not no_caption, zoom=zoom, scale=scale,
        )  # fmt: skip
        code = write_outputs(Source(run, world, tuple(plugin_files or ())), files, options, period)
    raise typer.Exit(code)


def _refuse_idle(options: Mapping[str, object], useful: tuple[str, ...], files: Mapping[str, Path]) -> None:
    """Refuse options that change nothing of what is asked for.

    Raises:
        typer.BadParameter: There is one.
    """
    if any(name in files for name in useful):
        return
    for option, value in options.items():
        if value is not None:
            names = " or ".join(f"--{name}" for name in useful)
            raise typer.BadParameter(f"{option} means nothing without {names}")
