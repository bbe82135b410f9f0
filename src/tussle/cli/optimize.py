"""The command line of `tussle optimize`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from tussle.cli.batch_commands import FirstSeed, RunTimeout, Stack, Vary, Workers
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

Objective = Annotated[
    str,
    typer.Option(
        metavar="QUANTITY",
        help="The quantity whose mean over the games is maximized: 'score[3]-score[2]', 'wins[2]', 't'.",
        show_default=False,
    ),
]
Minimize = Annotated[bool, typer.Option("--minimize", help="Minimize it instead.")]
Trials = Annotated[int, typer.Option(metavar="N", min=1, help="Sets of values that are tried.")]
RunsOfTrial = Annotated[
    int,
    typer.Option("--runs", "-n", metavar="N", min=1, help="Games of each trial, all with the same seeds."),
]
PerRound = Annotated[
    int, typer.Option(metavar="N", min=1, help="Trials that are proposed together and played side by side.")
]
Sampler = Annotated[
    str, typer.Option(metavar="NAME", help="Optuna's sampler that proposes trials: tpe, cmaes, random.")
]
SampleSeed = Annotated[int, typer.Option(metavar="N", min=0, help="Seed of the sampler.")]
StudyDirectory = Annotated[
    Path | None,
    typer.Option(
        "--out",
        metavar="DIR",
        help="Where trials are kept; by default optimizations/NAME-HASH. The same command goes on from there.",
        show_default=False,
    ),
]


def optimize(
    mission: MissionName,
    more: More = None,
    objective: Objective = "",
    vary: Vary = None,
    minimize: Minimize = False,
    trials: Trials = 100,
    runs: RunsOfTrial = 32,
    per_round: PerRound = 8,
    sampler: Sampler = "tpe",
    sample_seed: SampleSeed = 0,
    seed: FirstSeed = None,
    settings: Set = None,
    end: End = None,
    directory: StudyDirectory = None,
    processes: Workers = None,
    stack: Stack = None,
    run_timeout: RunTimeout = None,
    strict: Strict = False,
    plugin_files: PluginFiles = None,
    allow_large: Large = False,
    debug: Debug = False,
) -> None:
    """Search for the values with which a quantity of the game is greatest, or smallest."""
    if not objective:
        raise typer.BadParameter("--objective is missing: a quantity such as 'score[3]-score[2]'")
    if not vary:
        raise typer.BadParameter("--vary is missing: speed=20:30, gain=1e-3:10:log, tactic=keep,switch")
    with reported(debug):
        from tussle.cli.optimize_course import search

        source = mission_source(mission, settings, more, seed, end, strict, plugin_files, allow_large)
        code = search(
            source, objective, directory, trials, [Path(sys.argv[0]).name, *sys.argv[1:]], processes=processes, stack=stack,
            vary=tuple(vary), minimize=minimize, runs=runs, per_round=per_round, sampler=sampler, sample_seed=sample_seed,
            run_timeout=run_timeout,
        )  # fmt: skip
    raise typer.Exit(code)
