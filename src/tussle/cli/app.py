"""The commands of `tussle`."""

from __future__ import annotations

import os
import sys
from typing import Annotated

import typer

import tussle
from tussle.cli import batch_options, export_options, play_options, train_options
from tussle.cli.options import EPILOG, MissionOptions, PluginOptions, add_command
from tussle.cli.ros_node import RosNodeOptions
from tussle.cli.terminal import OK, out, run_guarded

COMMANDS = {
    "run": (play_options.RunOptions, "tussle.cli.play:run"),
    "check": (MissionOptions, "tussle.cli.play:check"),
    "convert": (play_options.ConvertOptions, "tussle.cli.play:convert"),
    "describe": (play_options.DescribeOptions, "tussle.cli.pages:describe"),
    "plugins": (PluginOptions, "tussle.cli.pages:plugins"),
    "schema": (play_options.SchemaOptions, "tussle.cli.schema:schema"),
    "missions": (play_options.MissionsOptions, "tussle.cli.pages:missions"),
    "new": (play_options.NewOptions, "tussle.cli.scaffold:new"),
    "export": (export_options.ExportOptions, "tussle.cli.export:export"),
    "view": (play_options.ViewOptions, "tussle.cli.view:view"),
    "replay": (play_options.ReplayOptions, "tussle.cli.view:replay"),
    "serve": (play_options.ServeOptions, "tussle.cli.serve:serve"),
    "plot": (export_options.PlotOptions, "tussle.cli.export:plot"),
    "batch": (batch_options.BatchOptions, "tussle.cli.batch:batch"),
    "analyze": (batch_options.AnalyzeOptions, "tussle.cli.analyze:analyze"),
    "report": (batch_options.ReportOptions, "tussle.cli.analyze:report"),
    "optimize": (batch_options.OptimizeOptions, "tussle.cli.optimize:optimize"),
    "stress": (batch_options.StressOptions, "tussle.cli.stress:stress"),
    "train": (train_options.TrainOptions, "tussle.cli.train:train"),
    "league": (train_options.LeagueOptions, "tussle.cli.league:league"),
    "ros-node": (RosNodeOptions, "tussle.cli.ros_node:ros_node"),
    "doctor": (play_options.DoctorOptions, "tussle.cli.doctor:doctor"),
}
"""Name, options and function of each command."""

app = typer.Typer(
    help="Simulate thousands of robots in one 3D world: play missions, inspect plugins, write your own.",
    epilog=EPILOG, no_args_is_help=True, add_completion=True, pretty_exceptions_enable=False, rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 80},
)  # fmt: skip


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


for name, (options, target) in COMMANDS.items():
    parser = {"cls": export_options.ExportCommand} if name == "export" else {}
    add_command(app, name, options, target, **parser)


def start() -> None:
    """Run the command line."""
    if sys.argv[1:2] in (["--show-completion"], ["--install-completion"]) and len(sys.argv) > 2:
        # Without this, Typer takes the shell that it runs in, whatever is named.
        os.environ["_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION"] = "1"
    run_guarded(lambda: app(prog_name="tussle"))
