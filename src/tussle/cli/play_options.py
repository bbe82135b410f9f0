"""Options of the commands that play, show and write games, and of those that list what there is."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path

import typer

from tussle.cli import completion
from tussle.cli.options import (
    MapOptions,
    MissionOptions,
    PluginOptions,
    argument,
    check_positive,
    columns_option,
    flag,
    option,
    read_time,
)
from tussle.errors import MAX_SHOWN, ParameterError, clipped

MAX_MARK = 200
"""Characters of a mark on the time line."""


@dataclass(frozen=True, kw_only=True)
class AgainOptions(MissionOptions):
    """A mission, or a game that was played before."""

    mission: str = argument(
        "MISSION",
        "A mission file, a built-in mission, or a plugin, for its example.",
        autocompletion=completion.missions,
        default="",
    )
    from_batch: str | None = option(
        "BATCH:RUN", "Play a run of a batch, or a run directory, again instead of a mission.", "--from"
    )
    trust: bool = flag(
        "--trust", "With --from: run the plugin code of a batch or run directory made by someone else."
    )

    def __post_init__(self) -> None:
        is_changed = self.mission or self.more or self.settings or self.plugin_files
        if self.from_batch is not None and (is_changed or (self.seed, self.end, self.compat) != (None,) * 3):
            raise typer.BadParameter(
                "--from BATCH:RUN determines the game, so a mission, settings, --seed, --end, --compat and --plugin-path"
                " are not allowed with it"
            )
        if self.from_batch is None and self.trust:
            raise typer.BadParameter("--trust is allowed with --from only")
        if self.from_batch is None and not self.mission:
            raise typer.BadParameter("a mission or --from BATCH:RUN is required")
        super().__post_init__()


@dataclass(frozen=True, kw_only=True)
class RunOptions(AgainOptions):
    """Play one game, record it, and show its result."""

    directory: Path | None = option("DIR", "Run directory; by default runs/NAME-SEED-TIMESTAMP.", "--out")
    no_log: bool = flag("--no-log", "Record nothing.")
    log_period: float | None = option("S", "Time between recorded states [s]; by default every step.")
    shapes: bool = flag("--shapes", "Record the shapes that plugins draw, too.")
    record_columns: str | None = columns_option()
    results: bool = flag(
        "--results", "Record scores and results after each step, too, for curves in replays."
    )
    pace: float | None = option("X", "Play at most X times as fast as real time. The result does not change.")
    start_from: Path | None = option(
        "TABLE", "Take ids, spawn times and initial states from a recorded trajectory."
    )

    def __post_init__(self) -> None:
        recorded = (
            self.directory,
            self.log_period,
            self.shapes or None,
            self.record_columns,
            self.results or None,
        )
        if self.no_log and recorded != (None,) * 5:
            raise typer.BadParameter(
                "--no-log records nothing, so --out, --log-period, --shapes, --record-columns and --results are not allowed with it"
            )
        check_positive(pace=self.pace, log_period=self.log_period)
        super().__post_init__()


@dataclass(frozen=True, kw_only=True)
class DescribeOptions(MissionOptions):
    """Show the parameters and channels of a plugin, or the entities and the step schedule of a mission."""

    mission: str = argument(
        "MISSION|PLUGIN",
        "A mission file, a built-in mission, or a plugin.",
        autocompletion=completion.plugins,
    )
    example: bool = flag("--example", "Print the mission file that shows what a plugin does.")


@dataclass(frozen=True, kw_only=True)
class MissionsOptions:
    """List the built-in missions."""


@dataclass(frozen=True, kw_only=True)
class DoctorOptions:
    """Show versions, extras, kernel cache and processors, and run a self-test."""


@dataclass(frozen=True, kw_only=True)
class SchemaOptions(PluginOptions):
    """Print the XML schema (XSD) of mission files, by which editors complete and check them."""


@dataclass(frozen=True, kw_only=True)
class ConvertOptions(MissionOptions):
    """Write a mission with all its values as one mission file, or as the Python code that builds it."""

    to: Path = option("FILE", "The file to write: NAME.xml or NAME.py.", default=...)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.to.suffix not in (".xml", ".py"):
            raise typer.BadParameter(
                f"--to {self.to} is not allowed; it takes a name that ends in .xml or .py"
            )


@dataclass(frozen=True, kw_only=True)
class NewOptions:
    """Write a working plugin, its test, and a mission that uses it."""

    kind: str = argument("KIND", "autonomy, motion, controller, sensor, interaction, metric or network.")
    name: str = argument("NAME", "Class name, such as MyBoids.")
    origin: str | None = option(
        "STOCK",
        "Start from a copy of this stock plugin.",
        "--from",
        autocompletion=completion.stock_plugins,
    )
    easy: bool = flag("--easy", "Write code for one entity, or one world, at a time.")
    directory: Path = option("DIR", "Directory for the files.", "--out", shows_default=True, default=Path())


@dataclass(frozen=True, kw_only=True)
class AlarmOptions:
    """Specifications that a page shows."""

    spec: list[str] = option(
        "SPEC",
        "Show how far the game is from breaking this, and alarms: 'always (distance(team 1, team 1) > 2 m)'. Can be repeated.",
        default=list,
    )
    margin: float | None = option(
        "X",
        "With --spec: alarm within this distance of failing, in the unit compared (SI); by default 1.",
    )

    def check_alarms(self) -> None:
        """Check the options.

        Raises:
            typer.BadParameter: There is a margin without a specification, or it is not positive.
        """
        if self.margin is not None and not self.spec:
            raise typer.BadParameter("--margin is allowed with --spec only")
        check_positive(margin=self.margin)


@dataclass(frozen=True, kw_only=True)
class RecordedAlarmOptions(AlarmOptions):
    """Specifications and moments that the page of a recorded game shows."""

    mark: list[str] = option(
        "TIME=TEXT",
        "Mark this moment on the time line: '12.4=lost from here on'. Can be repeated.",
        default=list,
    )

    @property
    def marks(self) -> list[tuple[float, str]]:
        """Time [s] and text of each mark."""
        return list(map(_mark, self.mark))

    def check_alarms(self) -> None:
        """Check the options, with the marks.

        Raises:
            typer.BadParameter: One is not allowed.
        """
        AlarmOptions.check_alarms(self)
        _ = self.marks


def _mark(given: str) -> tuple[float, str]:
    time, sign, text = given.partition("=")
    if not sign or not text.strip() or len(text) > MAX_MARK:
        raise typer.BadParameter(
            f"--mark {clipped(given, MAX_SHOWN)!r} is not allowed; it takes a time and a text of at most {MAX_MARK} characters: "
            "'12.4=lost from here on'"
        )
    try:
        return read_time("--mark", time), text.strip()
    except ParameterError as error:
        raise typer.BadParameter(str(error)) from None


# -- pages in the browser ---------------------------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class PageOptions(MapOptions, PluginOptions):
    """Options of the viewer page."""

    pace: str | None = option(
        "X|max", "Play X times as fast as real time, or as fast as possible; by default 1."
    )
    paused: bool = flag("--paused", "Do not start until told to on the page.")
    host: str = option(
        "ADDRESS",
        "Serve the page at this address of the machine. At any but 127.0.0.1, others who have the whole URL can watch and steer.",
        shows_default=True,
        default="127.0.0.1",
    )
    port: int | None = option(
        "N", "Serve the page at this port; by default the first free one from 8123.", min=1, max=65535
    )
    no_browser: bool = flag("--no-browser", "Open no browser, only print the address.")

    def __post_init__(self) -> None:
        if self.pace is None or self.pace == "max":
            return
        try:
            value = float(self.pace)
        except ValueError:
            value = math.nan
        if not 0.0 < value < math.inf:
            raise typer.BadParameter(f"--pace {self.pace} is not allowed; it takes a number > 0, or max")

    @property
    def speed(self) -> float | None:
        """Simulated seconds per second that `pace` asks for; None for as fast as possible."""
        return None if self.pace == "max" else float(self.pace or 1.0)


@dataclass(frozen=True, kw_only=True)
class ViewOptions(AgainOptions, PageOptions, AlarmOptions):
    """Play one game live on a page in the browser: pause it, step it, rewind it, follow entities."""

    pace: str | None = option(
        "X|max",
        "Play X times as fast as real time, or as fast as possible; by default as the mission says, or 1.",
    )
    record: Path | None = option("DIR", "Record the game into this directory, as tussle run does.")
    record_columns: str | None = columns_option()
    roles: bool = flag("--roles", "Print further addresses: for watching only, and for orders to one team.")
    operator: list[str] = option(
        "NAME=team N",
        "Print an address for somebody who gives orders to a team; their orders have this name. Can be repeated.",
        default=list,
    )
    link: str | None = option(
        "delay=S,loss=P,bandwidth=B,see=S",
        "Let orders come later [s], be lost with a probability, or share a bandwidth [bytes/s]; show the game later [s].",
    )
    exit_when_over: bool = flag("--exit-when-over", "End with the game, not only by Ctrl-C.")

    def __post_init__(self) -> None:
        AgainOptions.__post_init__(self)
        PageOptions.__post_init__(self)
        if self.record_columns is not None and self.record is None:
            raise typer.BadParameter("--record-columns is allowed with --record only")
        self.check_alarms()
        if len(self.operators) < len(self.operator):
            raise typer.BadParameter("--operator: a name is given twice")

    @property
    def operators(self) -> dict[str, int]:
        """Name -> team of who operates one."""
        return dict(map(_operator, self.operator))


def _operator(text: str) -> tuple[str, int]:
    found = re.fullmatch(r"(.*)= *team +(-?[0-9]{1,10})", text)
    if not found:
        raise typer.BadParameter(
            f"--operator {clipped(text, MAX_SHOWN)!r} is not allowed; it takes a name and a team: 'Ada=team 1'"
        )
    return found[1], int(found[2])


@dataclass(frozen=True, kw_only=True)
class ReplayOptions(PageOptions, RecordedAlarmOptions):
    """Play a recorded run on a page in the browser, or two runs from the moment at which they differ."""

    run: Path = argument("RUN", "A run directory, complete or not.")
    other: Path | None = argument(
        "RUN2", "Another run, shown beside the first from the moment at which they differ.", default=None
    )
    over: bool = option(
        None,
        "Draw two runs in one place, or next to each other.",
        "--over/--side-by-side",
        shows_default=True,
        default=False,
    )
    world: int = option("N", "World of a stack.", min=0, shows_default=True, default=0)

    def __post_init__(self) -> None:
        PageOptions.__post_init__(self)
        self.check_alarms()
        if self.over and self.other is None:
            raise typer.BadParameter("--over draws two runs in one place; a second run is required")


@dataclass(frozen=True, kw_only=True)
class ServeOptions(MissionOptions):
    """Serve a mission to programs in any language, which step it, read and write its columns, and publish messages."""

    worlds: int = option(
        "N",
        "Number of worlds; they have the seeds that follow.",
        min=1,
        max=100_000,
        shows_default=True,
        default=1,
    )
    host: str = option(
        "ADDRESS",
        "Serve at this address of the machine; at any but 127.0.0.1, others can connect.",
        shows_default=True,
        default="127.0.0.1",
    )
    port: int | None = option(
        "N", "Serve at this port; by default the first free one from 8123.", min=1, max=65535
    )
