"""Options of the commands that convert and plot recorded runs."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import typer

from tussle.cli.options import (
    MapOptions,
    PluginOptions,
    TussleCommand,
    argument,
    check_positive,
    flag,
    option,
)
from tussle.cli.play_options import RecordedAlarmOptions

DEFAULT_NAMES = {
    "html": "replay.html",
    "mp4": "film.mp4",
    "gif": "film.gif",
    "png": "picture.png",
    "mcap": "run.mcap",
    "rerun": "run.rrd",
    "rosbag2": "rosbag2",
    "geojson": "tracks.geojson",
    "kml": "tracks.kml",
    "czml": "tracks.czml",
    "csv": "states.csv",
    "parquet": "states.parquet",
}
"""Default file names of the outputs, in the run directory."""
DEFAULT_FILE = "@"
"""Placeholder for the default file, inserted by `ExportCommand`."""
FILMS = ("mp4", "gif")
IMAGES = (*FILMS, "png")
GEOGRAPHIC = ("geojson", "kml", "czml")
VIEWERS = ("mcap", "rerun")
USED_BY = {
    **dict.fromkeys(("camera", "follow", "start", "stop", "size", "trails", "labels", "no_caption", "zoom"), IMAGES),
    **dict.fromkeys(("speed", "fps"), FILMS),
    "at": ("png",),
    "scale": (*IMAGES, *VIEWERS),
    **dict.fromkeys(("map_file", "map_bounds"), (*IMAGES, "html", *VIEWERS)),
    "period": ("html", *VIEWERS, "rosbag2", *GEOGRAPHIC),
    **dict.fromkeys(("other", "over", "spec", "margin", "mark"), ("html",)),
    "epoch": ("kml", "czml"),
    "storage": ("rosbag2",),
}  # fmt: skip
"""Outputs that use an option."""
SPECIAL_NAMES = {"start": "--from", "stop": "--to", "map_file": "--map", "other": "a second run"}


class ExportCommand(TussleCommand):
    """A command whose output options may omit the file name: `tussle export RUN --mp4 --gif small.gif`."""

    def parse_args(self, ctx: typer.Context, args: list[str]) -> list[str]:  # type: ignore[override]
        """Insert the placeholder after output options without a file name."""
        options = {f"--{name}" for name in DEFAULT_NAMES}
        whole: list[str] = []
        for word, following in zip(args, [*args[1:], "--"], strict=True):
            whole.append(word)
            if word in options and following.startswith("-"):
                whole.append(DEFAULT_FILE)
        return super().parse_args(ctx, whole)


def _output(name: str, what: str) -> Any:
    return option("[FILE]", f"{what} By default RUN/{DEFAULT_NAMES[name]}.", f"--{name}")


@dataclass(frozen=True, kw_only=True)
class ExportOptions(MapOptions, PluginOptions, RecordedAlarmOptions):
    """Convert a recorded run to a web page, film, image or tables; several outputs at once are possible."""

    run: Annotated[Path, argument("RUN", "A run directory, complete or not.")]
    other: Annotated[Path | None, argument("[RUN2]", "With --html, another run beside the first.")] = None
    over: Annotated[bool, flag("--over", "Draw two runs in one place, not next to each other.")] = False
    html: Annotated[Path | None, _output("html", "A web page that replays the run offline.")] = None
    mp4: Annotated[Path | None, _output("mp4", "A film (H.264).")] = None
    gif: Annotated[Path | None, _output("gif", "A small animation.")] = None
    png: Annotated[Path | None, _output("png", "One image.")] = None
    mcap: Annotated[Path | None, _output("mcap", "A log for Foxglove.")] = None
    rerun: Annotated[Path | None, _output("rerun", "A recording for Rerun.")] = None
    rosbag2: Annotated[Path | None, _output("rosbag2", "A folder for ros2 bag.")] = None
    geojson: Annotated[Path | None, _output("geojson", "Tracks and areas by latitude and longitude.")] = None
    kml: Annotated[Path | None, _output("kml", "The same with times, for Google Earth.")] = None
    czml: Annotated[Path | None, _output("czml", "The same with times, for Cesium.")] = None
    csv: Annotated[Path | None, _output("csv", "Tables of states and events.")] = None
    parquet: Annotated[Path | None, _output("parquet", "The same tables, compressed.")] = None
    world: Annotated[int | None, option("N", "World of a stack; by default 0, for tables all.", min=0)] = None
    camera: Annotated[
        str | None,
        option(
            "overview|top|follow",
            "Camera of films and images: all entities from the south, from above, or behind one entity; by default overview.",
        ),
    ] = None
    follow: Annotated[int | None, option("ID", "Follow this entity.")] = None
    start: Annotated[str | None, option("TIME", "Start time of a film: 60, or '2 min'.", "--from")] = None
    stop: Annotated[str | None, option("TIME", "End time of a film.", "--to")] = None
    at: Annotated[str | None, option("TIME", "Time of the image; by default the middle.")] = None
    speed: Annotated[
        float | None,
        option("X", "Simulated seconds per second of film; by default the film lasts at most 30 s."),
    ] = None
    fps: Annotated[float | None, option("N", "Frames per second; by default 25.")] = None
    size: Annotated[str | None, option("WIDTHxHEIGHT", "Size of films and images; by default 1280x720.")] = (
        None
    )
    trails: Annotated[float | None, option("S", "Duration of the trails [s]; 0 for none.")] = None
    labels: Annotated[bool, flag("--labels", "Show the ids of the entities.")] = False
    no_caption: Annotated[bool, flag("--no-caption", "Show no caption on films and images.")] = False
    zoom: Annotated[float | None, option("X", "Zoom factor.")] = None
    scale: Annotated[float | None, option("X", "Factor on the size of the models.")] = None
    period: Annotated[
        float | None,
        option("S", "Time between the states, except in tables and films [s]; by default all states."),
    ] = None
    epoch: Annotated[
        str | None,
        option("DATE", "Date and time of t = 0 in --kml and --czml; by default 2000-01-01T00:00:00Z."),
    ] = None

    storage: Annotated[str | None, option("mcap|sqlite3", "File format of --rosbag2; by default mcap.")] = (
        None
    )

    def __post_init__(self) -> None:
        if not self.files:
            raise typer.BadParameter(f"no output is given; possible outputs: {_listed(DEFAULT_NAMES, ', ')}")
        for name, outputs in USED_BY.items():
            if getattr(self, name) not in (None, False, []) and not any(
                each in self.files for each in outputs
            ):
                shown = SPECIAL_NAMES.get(name, f"--{name.replace('_', '-')}")
                raise typer.BadParameter(f"{shown} is allowed with {_listed(outputs, ' or ')} only")
        if self.over and self.other is None:
            raise typer.BadParameter("--over draws two runs in one place; a second run is required")
        check_positive(period=self.period)
        self.check_alarms()

    @property
    def files(self) -> dict[str, Path]:
        """The file of each output that is asked for."""
        asked = {name: getattr(self, name) for name in DEFAULT_NAMES}
        return {
            name: self.run / DEFAULT_NAMES[name] if str(file) == DEFAULT_FILE else file
            for name, file in asked.items()
            if file is not None
        }


def _listed(names: Iterable[str], separator: str) -> str:
    return separator.join(f"--{name}" for name in names)


@dataclass(frozen=True, kw_only=True)
class PlotOptions(PluginOptions):
    """Plot a recorded run: trajectories, speed, altitude, entities left, captures, density; columns also of several runs or a batch."""

    run: Annotated[
        Path,
        argument("RUN", "A run directory, complete or not; with --column also a batch with recorded runs."),
    ]
    others: Annotated[
        list[Path] | None,
        argument("[RUN]...", "Further runs or batches, whose columns are compared with the first."),
    ] = None
    kinds: Annotated[
        list[str],
        option(
            "KIND",
            "trajectory, trajectory3d, speed, altitude, left, captures, density or distance; by default all that have data. "
            "Can be repeated.",
            "--kind",
        ),
    ] = field(default_factory=list)
    columns: Annotated[
        list[str],
        option(
            "NAME",
            "Plot this column over time: one of a plugin that was recorded, such as Boids.goal or Boids.goal.x, or x, y, z, vx, vy, vz, "
            "qw, qx, qy, qz, health. Can be repeated.",
            "--column",
        ),
    ] = field(default_factory=list)
    between: Annotated[
        tuple[int, int] | None, option("ID ID", "Plot the distance between these two entities.")
    ] = None
    teams: Annotated[list[int], option("N", "Only this team. Can be repeated.", "--team")] = field(
        default_factory=list
    )
    entities: Annotated[list[int], option("ID", "Only this entity. Can be repeated.", "--entity")] = field(
        default_factory=list
    )
    start: Annotated[str | None, option("TIME", "Start at this time: 60, or '2 min'.", "--from")] = None
    stop: Annotated[str | None, option("TIME", "End at this time.", "--to")] = None
    world: Annotated[int, option("N", "World of a stack.", min=0, shows_default=True)] = 0
    form: Annotated[str, option("png|svg|pdf", "File format.", "--format", shows_default=True)] = "png"
    directory: Annotated[
        Path | None, option("DIR", "Directory for the plots; by default RUN/plots.", "--out")
    ] = None
