"""Commands of `tussle` and their options."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import tussle
from tussle.cli.analyze import analyze
from tussle.cli.batch_commands import batch
from tussle.cli.doctor import doctor
from tussle.cli.export import ExportCommand, export
from tussle.cli.optimize import optimize
from tussle.cli.options import (
    EPILOG,
    Debug,
    End,
    Large,
    MissionName,
    More,
    PluginFiles,
    Seed,
    Set,
    Strict,
    mission_source,
)
from tussle.cli.plot import plot
from tussle.cli.replay import replay
from tussle.cli.report import report
from tussle.cli.terminal import OK, out, reported, run_guarded
from tussle.cli.view import view

app = typer.Typer(
    help="Simulate thousands of robots in one 3D world: play missions, inspect plugins, write your own.",
    epilog=EPILOG, no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 80},
)  # fmt: skip


MissionOrNone = Annotated[
    str | None,
    typer.Argument(
        metavar="MISSION",
        help="A mission file, or the name of a built-in mission (tussle missions).",
        show_default=False,
    ),
]
FromRun = Annotated[
    str | None,
    typer.Option(
        "--from",
        metavar="BATCH:RUN",
        help="Play a run of a batch again instead of a mission.",
        show_default=False,
    ),
]
Trust = Annotated[
    bool,
    typer.Option(
        "--trust", help="With --from: run the plugin code of a batch directory made by someone else."
    ),
]
RunDirectory = Annotated[
    Path | None,
    typer.Option(
        "--out",
        metavar="DIR",
        help="Run directory; by default runs/NAME-SEED-TIMESTAMP.",
        show_default=False,
    ),
]
LogPeriod = Annotated[
    float | None,
    typer.Option(
        metavar="S", help="Time between recorded states [s]; by default every step.", show_default=False
    ),
]
Pace = Annotated[
    float | None,
    typer.Option(
        metavar="X",
        help="Play at most X times as fast as real time. The result does not change.",
        show_default=False,
    ),
]
StartFrom = Annotated[
    Path | None,
    typer.Option(
        metavar="TABLE",
        help="Take ids, spawn times and initial states from a recorded trajectory.",
        show_default=False,
    ),
]


def _version(is_asked: bool) -> None:
    if is_asked:
        out().print(f"tussle {tussle.__version__}")
        raise typer.Exit(OK)


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", help="Show the version.", callback=_version, is_eager=True)
    ] = False,
) -> None:
    pass


@app.command(epilog=EPILOG)
def run(
    mission: MissionOrNone = None,
    more: More = None,
    from_batch: FromRun = None,
    trust: Trust = False,
    seed: Seed = None,
    settings: Set = None,
    end: End = None,
    directory: RunDirectory = None,
    no_log: Annotated[bool, typer.Option("--no-log", help="Record nothing.")] = False,
    log_period: LogPeriod = None,
    pace: Pace = None,
    start_from: StartFrom = None,
    strict: Strict = False,
    plugin_files: PluginFiles = None,
    allow_large: Large = False,
    debug: Debug = False,
) -> None:
    """Play one game, record it, and show its result."""
    if no_log and (directory is not None or log_period is not None):
        raise typer.BadParameter(
            "--no-log records nothing, so --out and --log-period are not allowed with it"
        )
    for name, value in (("--pace", pace), ("--log-period", log_period)):
        if value is not None and not 0.0 < value < float("inf"):
            raise typer.BadParameter(f"{name} {value:g} is not allowed; it takes a number > 0")
    is_changed = any(x for x in (mission, more, settings, plugin_files)) or (seed, end) != (None, None)
    if from_batch is not None and is_changed:
        raise typer.BadParameter(
            "--from BATCH:RUN determines the game, so a mission, settings, --seed, --end and --plugin-path are not allowed with it"
        )
    if from_batch is None and trust:
        raise typer.BadParameter("--trust is allowed with --from only")
    if from_batch is None and mission is None:
        raise typer.BadParameter("a mission or --from BATCH:RUN is required")
    with reported(debug):
        from tussle.cli.play import Game, Record, play

        if from_batch is not None:
            from tussle.cli.from_batch import FromBatch

            source: Game = FromBatch(from_batch, trust, allow_large)
        else:
            source = mission_source(
                mission or "", settings, more, seed, end, strict, plugin_files, allow_large
            )
        code = play(source, Record(directory, not no_log, log_period), pace, start_from)
    raise typer.Exit(code)


@app.command(epilog=EPILOG)
def check(
    mission: MissionName,
    more: More = None,
    settings: Set = None,
    strict: Strict = False,
    plugin_files: PluginFiles = None,
    allow_large: Large = False,
    debug: Debug = False,
) -> None:
    """Check a mission: read it, build its game, and report all errors."""
    with reported(debug):
        from tussle.cli.play import simulate
        from tussle.cli.progress import compiling

        source = mission_source(mission, settings, more, None, None, strict, plugin_files, allow_large)
        loaded, made, seed = source.read()
        with compiling(), simulate(loaded, made, seed) as simulation:
            n = sum(block.count for block in made.blocks)
            notes = f", {len(loaded.notes)} note(s)" if loaded.notes else ""
            out().print(
                f"{mission} can be played: {n} entities, grade {simulation.grade}{notes}", soft_wrap=True
            )


@app.command(epilog=EPILOG)
def describe(
    name: Annotated[
        str,
        typer.Argument(
            metavar="MISSION|PLUGIN",
            help="A mission file, a built-in mission, or a plugin.",
            show_default=False,
        ),
    ],
    more: More = None,
    settings: Set = None,
    strict: Strict = False,
    plugin_files: PluginFiles = None,
    allow_large: Large = False,
    debug: Debug = False,
) -> None:
    """Show the parameters and channels of a plugin, or the entities and the step schedule of a mission."""
    with reported(debug):
        from tussle.cli import pages
        from tussle.cli.lookup import plugin_named

        found = plugin_named(name, plugin_files or ())
        if found is not None:
            pages.show_plugin(name, found)
            return
        from tussle.cli.play import simulate
        from tussle.cli.progress import compiling

        loaded, made, seed = mission_source(
            name, settings, more, None, None, strict, plugin_files, allow_large
        ).read()
        with compiling(), simulate(loaded, made, seed) as simulation:
            pages.show_mission(loaded.name, loaded.path, made, simulation, seed)


@app.command(epilog=EPILOG)
def plugins(plugin_files: PluginFiles = None, debug: Debug = False) -> None:
    """List all plugins: those of tussle, of other packages, and of your files."""
    with reported(debug):
        from tussle.cli import pages
        from tussle.cli.lookup import all_plugins
        from tussle.cli.terminal import WRONG_INPUT, say_error, say_note

        found, wrong, hidden = all_plugins(plugin_files or ())
        pages.show_plugins(found)
        for text in hidden:
            say_note(text)
        for text in wrong:
            say_error(text)
        if wrong:
            raise typer.Exit(WRONG_INPUT)


@app.command(epilog=EPILOG)
def missions(debug: Debug = False) -> None:
    """List the built-in missions."""
    with reported(debug):
        from tussle.cli import pages

        pages.show_missions()


@app.command(epilog=EPILOG)
def new(
    kind: Annotated[
        str,
        typer.Argument(
            metavar="KIND",
            help="autonomy, motion, controller, sensor, interaction, metric or network.",
            show_default=False,
        ),
    ],
    name: Annotated[
        str, typer.Argument(metavar="NAME", help="Class name, such as MyBoids.", show_default=False)
    ],
    origin: Annotated[
        str | None,
        typer.Option(
            "--from", metavar="STOCK", help="Start from a copy of this stock plugin.", show_default=False
        ),
    ] = None,
    easy: Annotated[
        bool, typer.Option("--easy", help="Write code for one entity, or one world, at a time.")
    ] = False,
    directory: Annotated[
        Path, typer.Option("--out", metavar="DIR", help="Directory for the files.")
    ] = Path(),
    debug: Debug = False,
) -> None:
    """Write a working plugin, its test, and a mission that uses it."""
    with reported(debug):
        from tussle.cli import pages
        from tussle.cli.progress import compiling
        from tussle.cli.scaffold import write_plugin

        with compiling():
            written = write_plugin(kind, name, origin, directory, easy)
        pages.show_written(written.files, written.next_steps)


app.command(epilog=EPILOG, cls=ExportCommand)(export)
for command in (view, replay, plot, batch, analyze, report, optimize, doctor):
    app.command(epilog=EPILOG)(command)


def start() -> None:
    """Run the command line."""
    run_guarded(lambda: app(prog_name="tussle"))
