"""`tussle export RUN`: convert a recorded run to a web page, film, image or tables."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import typer
from typer.core import TyperCommand

from tussle.cli.options import Debug, PluginFiles
from tussle.cli.terminal import reported

DEFAULT_NAMES = {
    "html": "replay.html",
    "mp4": "film.mp4",
    "gif": "film.gif",
    "png": "picture.png",
    "mcap": "run.mcap",
    "csv": "states.csv",
    "parquet": "states.parquet",
}
"""Default file names of the outputs, in the run directory."""
BESIDE = "@"
"""Placeholder for the default file, inserted by `ExportCommand`."""
FILMS = ("mp4", "gif", "png")


class ExportCommand(TyperCommand):
    """A command whose output options may omit the file name: `tussle export RUN --mp4 --gif small.gif`."""

    def parse_args(self, ctx: typer.Context, args: list[str]) -> list[str]:  # type: ignore[override]
        """Insert the placeholder after output options without a file name."""
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
    Path, typer.Argument(metavar="RUN", help="A run directory, complete or not.", show_default=False)
]
Html = Annotated[Path | None, _output("html", "A web page that replays the run offline.")]
Mp4 = Annotated[Path | None, _output("mp4", "A film (H.264).")]
Gif = Annotated[Path | None, _output("gif", "A small animation.")]
Png = Annotated[Path | None, _output("png", "One image.")]
Mcap = Annotated[Path | None, _output("mcap", "A log for Foxglove.")]
Csv = Annotated[Path | None, _output("csv", "Tables of states and events.")]
Parquet = Annotated[Path | None, _output("parquet", "The same tables, compressed.")]
World = Annotated[
    int | None,
    typer.Option(
        metavar="N", min=0, help="World of a stack; by default 0, for tables all.", show_default=False
    ),
]
CameraName = Annotated[
    str | None,
    typer.Option(
        "--camera",
        metavar="overview|top|follow",
        help="Camera of films and images: all entities from the south, from above, or behind one entity; by default overview.",
        show_default=False,
    ),
]
FollowId = Annotated[
    int | None, typer.Option("--follow", metavar="ID", help="Follow this entity.", show_default=False)
]
Start = Annotated[
    str | None,
    typer.Option("--from", metavar="TIME", help="Start time of a film: 60, or '2 min'.", show_default=False),
]
Stop = Annotated[
    str | None, typer.Option("--to", metavar="TIME", help="End time of a film.", show_default=False)
]
At = Annotated[
    str | None,
    typer.Option(
        "--at", metavar="TIME", help="Time of the image; by default the middle.", show_default=False
    ),
]
Speed = Annotated[
    float | None,
    typer.Option(
        metavar="X",
        help="Simulated seconds per second of film; by default chosen so that the film lasts at most 30 s.",
        show_default=False,
    ),
]
Fps = Annotated[
    float | None, typer.Option(metavar="N", help="Frames per second; by default 25.", show_default=False)
]
Size = Annotated[
    str | None,
    typer.Option(
        metavar="WIDTHxHEIGHT", help="Size of films and images; by default 1280x720.", show_default=False
    ),
]
Trails = Annotated[
    float | None,
    typer.Option(metavar="S", help="Duration of the trails [s]; 0 for none.", show_default=False),
]
Labels = Annotated[bool, typer.Option("--labels", help="Show the ids of the entities.")]
NoCaption = Annotated[bool, typer.Option("--no-caption", help="Show no caption on films and images.")]
Zoom = Annotated[float | None, typer.Option(metavar="X", help="Zoom factor.", show_default=False)]
Scale = Annotated[
    float | None,
    typer.Option(metavar="X", help="Factor on the size of the models.", show_default=False),
]
Period = Annotated[
    float | None,
    typer.Option(
        metavar="S",
        help="Time between the states in --html and --mcap [s]; by default all states.",
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
    """Convert a recorded run to a web page, film, image or tables; several outputs at once are possible."""
    asked = {"html": html, "mp4": mp4, "gif": gif, "png": png, "mcap": mcap, "csv": csv, "parquet": parquet}
    files = {
        name: run / DEFAULT_NAMES[name] if str(file) == BESIDE else file
        for name, file in asked.items()
        if file is not None
    }
    if not files:
        names = ", ".join(f"--{name}" for name in asked)
        raise typer.BadParameter(f"no output is given; possible outputs: {names}")
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
    with reported(debug):
        from tussle.cli.exporting import Source, film_options, write_outputs

        options = film_options(
            camera=camera or ("overview" if follow is None else "follow"), follow=follow, start=start, stop=stop, at=at,
            speed=speed, fps=fps, size=size, trails=trails, labels=labels, captions=not no_caption, zoom=zoom, scale=scale,
        )  # fmt: skip
        code = write_outputs(Source(run, world, tuple(plugin_files or ())), files, options, period)
    raise typer.Exit(code)


def _refuse_idle(options: Mapping[str, object], useful: tuple[str, ...], files: Mapping[str, Path]) -> None:
    """Refuse options that none of the outputs uses.

    Raises:
        typer.BadParameter: An option is not used.
    """
    if any(name in files for name in useful):
        return
    for option, value in options.items():
        if value is not None:
            names = " or ".join(f"--{name}" for name in useful)
            raise typer.BadParameter(f"{option} is allowed with {names} only")
