"""Options of the commands that convert and plot recorded runs."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

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

    run: Path = argument("RUN", "A run directory, complete or not.")
    other: Path | None = argument("[RUN2]", "With --html, another run beside the first.", default=None)
    over: bool = flag("--over", "Draw two runs in one place, not next to each other.")
    html: Path | None = _output("html", "A web page that replays the run offline.")
    mp4: Path | None = _output("mp4", "A film (H.264).")
    gif: Path | None = _output("gif", "A small animation.")
    png: Path | None = _output("png", "One image.")
    mcap: Path | None = _output("mcap", "A log for Foxglove.")
    rerun: Path | None = _output("rerun", "A recording for Rerun.")
    rosbag2: Path | None = _output("rosbag2", "A folder for ros2 bag.")
    geojson: Path | None = _output("geojson", "Tracks and areas by latitude and longitude.")
    kml: Path | None = _output("kml", "The same with times, for Google Earth.")
    czml: Path | None = _output("czml", "The same with times, for Cesium.")
    csv: Path | None = _output("csv", "Tables of states and events.")
    parquet: Path | None = _output("parquet", "The same tables, compressed.")
    world: int | None = option("N", "World of a stack; by default 0, for tables all.", min=0)
    camera: str | None = option(
        "overview|top|follow",
        "Camera of films and images: all entities from the south, from above, or behind one entity; by default overview.",
    )
    follow: int | None = option("ID", "Follow this entity.")
    start: str | None = option("TIME", "Start time of a film: 60, or '2 min'.", "--from")
    stop: str | None = option("TIME", "End time of a film.", "--to")
    at: str | None = option("TIME", "Time of the image; by default the middle.")
    speed: float | None = option(
        "X", "Simulated seconds per second of film; by default the film lasts at most 30 s."
    )
    fps: float | None = option("N", "Frames per second; by default 25.")
    size: str | None = option("WIDTHxHEIGHT", "Size of films and images; by default 1280x720.")
    trails: float | None = option("S", "Duration of the trails [s]; 0 for none.")
    labels: bool = flag("--labels", "Show the ids of the entities.")
    no_caption: bool = flag("--no-caption", "Show no caption on films and images.")
    zoom: float | None = option("X", "Zoom factor.")
    scale: float | None = option("X", "Factor on the size of the models.")
    period: float | None = option(
        "S", "Time between the states, except in tables and films [s]; by default all states."
    )
    epoch: str | None = option(
        "DATE", "Date and time of t = 0 in --kml and --czml; by default 2000-01-01T00:00:00Z."
    )

    storage: str | None = option("mcap|sqlite3", "File format of --rosbag2; by default mcap.")

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

    run: Path = argument(
        "RUN", "A run directory, complete or not; with --column also a batch with recorded runs."
    )
    others: list[Path] | None = argument(
        "[RUN]...", "Further runs or batches, whose columns are compared with the first.", default=None
    )
    kinds: list[str] = option(
        "KIND",
        "trajectory, trajectory3d, speed, altitude, left, captures, density or distance; by default all that have data. "
        "Can be repeated.",
        "--kind",
        default=list,
    )
    columns: list[str] = option(
        "NAME",
        "Plot this column over time: one of a plugin that was recorded, such as Boids.goal or Boids.goal.x, or x, y, z, vx, vy, vz, "
        "qw, qx, qy, qz, health. Can be repeated.",
        "--column",
        default=list,
    )
    between: tuple[int, int] | None = option("ID ID", "Plot the distance between these two entities.")
    teams: list[int] = option("N", "Only this team. Can be repeated.", "--team", default=list)
    entities: list[int] = option("ID", "Only this entity. Can be repeated.", "--entity", default=list)
    start: str | None = option("TIME", "Start at this time: 60, or '2 min'.", "--from")
    stop: str | None = option("TIME", "End at this time.", "--to")
    world: int = option("N", "World of a stack.", min=0, shows_default=True, default=0)
    form: str = option("png|svg|pdf", "File format.", "--format", shows_default=True, default="png")
    directory: Path | None = option("DIR", "Directory for the plots; by default RUN/plots.", "--out")
