"""The command line of batches."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from tussle.cli.options import (
    Debug,
    End,
    Large,
    MissionName,
    More,
    PluginFiles,
    Set,
    Strict,
    mission_source,
)
from tussle.cli.terminal import reported

Runs = Annotated[
    int | None,
    typer.Option(
        "--runs",
        "-n",
        metavar="N",
        min=1,
        help="Games of each point, that is of each set of varied values; 100 unless the sweep file says.",
        show_default=False,
    ),
]
Vary = Annotated[
    list[str] | None,
    typer.Option(
        "--vary",
        metavar="NAME=VALUES",
        help="What varies: speed=20:30, prey.count=50:100:int, gain=1e-3:10:log, tactic=keep,switch. As often as needed.",
        show_default=False,
    ),
]
FirstSeed = Annotated[
    int | None,
    typer.Option(
        "--seed",
        metavar="N",
        min=0,
        max=2**64 - 1,
        help="Seeds count up from here; by default from 1.",
        show_default=False,
    ),
]
Workers = Annotated[
    int | None,
    typer.Option(
        "--processes", metavar="N", min=1, help="How many; by default one per core.", show_default=False
    ),
]
Stack = Annotated[
    int | None,
    typer.Option(
        "--stack",
        metavar="N",
        min=1,
        help="Games side by side in each process; by default what suits the mission.",
        show_default=False,
    ),
]
RunTimeout = Annotated[
    float | None,
    typer.Option(
        metavar="S",
        help="Give up a game that takes longer than S seconds, and record it as failed; by default none is given up.",
        show_default=False,
    ),
]


SweepFile = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        help="A sweep file (TOML) or ranges file (XML) with what varies.",
        show_default=False,
    ),
]
Sample = Annotated[
    str | None,
    typer.Option(
        metavar="METHOD",
        help="How points are chosen: lhs, sobol, saltelli, grid, list, product.",
        show_default=False,
    ),
]
Samples = Annotated[
    int | None,
    typer.Option(metavar="N", min=1, help="How many points are drawn.", show_default=False),
]
SampleSeed = Annotated[
    int | None,
    typer.Option(metavar="N", min=0, help="Seed of the drawing; 0 by default.", show_default=False),
]
Independent = Annotated[
    bool,
    typer.Option(
        "--independent", help="Each game has a seed of its own, instead of the same seeds at all points."
    ),
]
UntilWidth = Annotated[
    str | None,
    typer.Option(
        metavar="WIDTH",
        help="Stop when half of a 95 % interval is this narrow: 0.02 (share of wins of each team), 'score[2]:0.5'.",
        show_default=False,
    ),
]
BatchDirectory = Annotated[
    Path | None,
    typer.Option(
        "--out",
        metavar="DIR",
        help="The batch directory; by default batches/NAME-HASH, the same for the same batch. What is there is not played again.",
        show_default=False,
    ),
]
LogRuns = Annotated[
    str | None,
    typer.Option(metavar="RUNS", help="Record these runs in full: 417,3,10:20.", show_default=False),
]
Scheduler = Annotated[
    str | None,
    typer.Option(metavar="ADDRESS", help="Play on a Dask cluster: tcp://HOST:8786.", show_default=False),
]
Slurm = Annotated[
    str | None,
    typer.Option(metavar="N[,OPTION=VALUE...]", help="Play in N Slurm jobs.", show_default=False),
]


def batch(
    mission: MissionName,
    more: More = None,
    runs: Runs = None,
    vary: Vary = None,
    sweep: SweepFile = None,
    sample: Sample = None,
    samples: Samples = None,
    sample_seed: SampleSeed = None,
    seed: FirstSeed = None,
    independent: Independent = False,
    until: UntilWidth = None,
    settings: Set = None,
    end: End = None,
    directory: BatchDirectory = None,
    log: LogRuns = None,
    processes: Workers = None,
    stack: Stack = None,
    run_timeout: RunTimeout = None,
    scheduler: Scheduler = None,
    slurm: Slurm = None,
    strict: Strict = False,
    plugin_files: PluginFiles = None,
    allow_large: Large = False,
    debug: Debug = False,
) -> None:
    """Play a game many times, with other seeds and values, and tell who wins how often."""
    if (scheduler is not None or slurm is not None) and processes is not None:
        raise typer.BadParameter(
            "--processes counts those of this machine; it means nothing beside --scheduler and --slurm"
        )
    if (scheduler is not None or slurm is not None) and run_timeout is not None:
        raise typer.BadParameter(
            "--run-timeout is for processes of this machine; beside --scheduler and --slurm, limit the time of the jobs"
        )
    if scheduler is not None and slurm is not None:
        raise typer.BadParameter("--scheduler and --slurm are two places to play; give one of them")
    with reported(debug):
        from tussle.cli.batch import BatchOptions, play_batch

        source = mission_source(mission, settings, more, seed, end, strict, plugin_files, allow_large)
        asked = BatchOptions(
            source, runs, tuple(vary or ()), sweep, sample, samples, sample_seed, independent, until, directory,
            processes, stack, run_timeout, scheduler, slurm, log,
        )  # fmt: skip
        code = play_batch(asked, [Path(sys.argv[0]).name, *sys.argv[1:]])
    raise typer.Exit(code)
