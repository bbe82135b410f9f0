"""Options of the commands for batches and searches."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import typer

from tussle.cli.options import (
    MAX_SEED,
    MissionOptions,
    argument,
    columns_option,
    flag,
    option,
    over_option,
)


@dataclass(frozen=True, kw_only=True)
class PoolOptions(MissionOptions):
    """Options shared by all commands that play many games."""

    seed: int | None = option("N", "First seed; by default 1. The others follow it.", min=0, max=MAX_SEED)
    processes: int | None = option("N", "Number of processes; by default one per core.", min=1)
    stack: int | None = option(
        "N", "Games played side by side in each process; by default chosen by the mission.", min=1
    )
    run_timeout: float | None = option(
        "S", "Stop a game that takes longer than S seconds, and record it as failed; by default never."
    )


@dataclass(frozen=True, kw_only=True)
class ManyGamesOptions(PoolOptions):
    """Options shared by batches and searches."""

    vary: list[str] = option(
        "NAME=VALUES",
        "Vary a value: speed=20:30, prey.count=50:100:int, gain=1e-3:10:log, tactic=keep,switch. Can be repeated.",
        default=list,
    )


@dataclass(frozen=True, kw_only=True)
class BatchOptions(ManyGamesOptions):
    """Play a game many times, with other seeds and values, and show who wins how often."""

    runs: int | None = option(
        "N",
        "Games of each point, that is of each set of varied values; by default as the sweep file says, or 100.",
        "--runs",
        "-n",
        min=1,
    )
    sweep: Path | None = option("FILE", "A sweep file (TOML) or ranges file (XML) with the varied values.")
    sample: str | None = option("METHOD", "Sampling method: lhs, sobol, saltelli, grid, list, product.")
    samples: int | None = option("N", "Number of points to sample.", min=1)
    sample_seed: int | None = option("N", "Seed of the sampling; by default 0.", min=0)
    independent: bool = flag(
        "--independent", "Each game has its own seed, instead of the same seeds at all points."
    )
    until: str | None = option(
        "WIDTH",
        "Stop when half of a 95 % interval is this narrow: 0.02 (share of wins of each team), 'score[2]:0.5'. Or play only "
        "the points whose interval is not yet: 'width(Guard.share) < 0.02'.",
    )
    target: str | None = option(
        "EXPR",
        "Find the smallest value at which a mean reaches a target, and play only what that needs: 'Guard.share >= 0.95'. Up to "
        "1,000 games of each point, or --runs.",
    )
    over: str | None = over_option()
    directory: Path | None = option(
        "DIR",
        "Batch directory; by default batches/NAME-HASH, the same for the same batch. Its finished runs are not repeated.",
        "--out",
    )
    record_runs: str | None = option("RUNS", "Record these runs in full: 417,3,10:20.")
    record_columns: str | None = columns_option()
    scheduler: str | None = option("ADDRESS", "Play on a Dask cluster: tcp://HOST:8786.")
    slurm: str | None = option("N[,OPTION=VALUE...]", "Play in N Slurm jobs.")

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.record_columns is not None and self.record_runs is None:
            raise typer.BadParameter("--record-columns is allowed with --record-runs only")
        if self.scheduler is None and self.slurm is None:
            return
        if self.processes is not None:
            raise typer.BadParameter(
                "--processes counts those of this machine; it is not allowed with --scheduler and --slurm"
            )
        if self.run_timeout is not None:
            raise typer.BadParameter(
                "--run-timeout is for processes of this machine; with --scheduler and --slurm, limit the time of the jobs"
            )
        if self.scheduler is not None and self.slurm is not None:
            raise typer.BadParameter("--scheduler and --slurm are two places to play; only one is allowed")


@dataclass(frozen=True, kw_only=True)
class OptimizeOptions(ManyGamesOptions):
    """Search for the values with which a quantity of the game is greatest, or smallest."""

    objective: str = option(
        "QUANTITY",
        "Quantity whose mean over the games is maximized: 'score[3]-score[2]', 'wins[2]', 't'.",
        default="",
    )
    subject_to: list[str] = option(
        "EXPR",
        "Constraint that the mean over the games is to keep: 'lost[1] / start[1] < 0.2'. Can be repeated.",
        "--subject-to",
        default=list,
    )
    minimize: bool = flag("--minimize", "Minimize the quantity instead.")
    trials: int = option("N", "Sets of values to try.", min=1, shows_default=True, default=100)
    runs: int = option(
        "N",
        "Games of each trial, all with the same seeds.",
        "--runs",
        "-n",
        min=1,
        shows_default=True,
        default=32,
    )
    per_round: int = option(
        "N", "Trials that are proposed and played together.", min=1, shows_default=True, default=8
    )
    sampler: str = option(
        "NAME",
        "Sampler of Optuna that proposes the trials: tpe, cmaes, random.",
        shows_default=True,
        default="tpe",
    )
    sample_seed: int = option("N", "Seed of the sampler.", min=0, shows_default=True, default=0)
    directory: Path | None = option(
        "DIR",
        "Directory of the search; by default optimizations/NAME-HASH. The same command continues the search.",
        "--out",
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.objective:
            raise typer.BadParameter("--objective is missing: a quantity such as 'score[3]-score[2]'")
        if not self.vary:
            raise typer.BadParameter("--vary is missing: speed=20:30, gain=1e-3:10:log, tactic=keep,switch")


@dataclass(frozen=True, kw_only=True)
class StressOptions(ManyGamesOptions):
    """Find how a mission fails: how often its games break a specification, how near the others come, and how rare failures are."""

    spec: str = option(
        "SPEC",
        "What must hold: 'always (distance(team 1, team 1) > 2 m)', 'lost[1] / start[1] < 0.2', or FILE.py:FUNCTION.",
        default="",
    )
    games: int = option("N", "Games to play.", "--games", "-n", min=1, shows_default=True, default=1000)
    against: str | None = option(
        "OTHER",
        "Search for games that fail while the same game of another mission does not: a mission file, or NAME=VALUE[,NAME=VALUE].",
    )
    sampler: str = option(
        "NAME",
        "With --vary: what proposes the values: cmaes, tpe, random.",
        shows_default=True,
        default="cmaes",
    )
    sample_seed: int = option(
        "N", "With --vary: seed of what proposes the values.", min=0, shows_default=True, default=0
    )
    probability: bool = flag(
        "--probability", "Estimate how likely a failure is, however rare, by games that branch."
    )
    importance: bool = flag(
        "--importance",
        "With --probability and --vary NAME='normal(10, 2)', lognormal or uniform: importance sampling of these values.",
    )
    why: bool = flag(
        "--why",
        "Show why and when the worst failing game was lost: what undoes the failure, by branches of it.",
    )
    shrink: bool = flag(
        "--shrink", "Make the worst failing game as small as it can be, as failures/smallest.xml."
    )
    guide: str = option(
        "SPEC",
        "With --probability: what games break on their way to a failure: 'always (approach(all, all, 1 m/s) > 1 m)'.",
        default="",
    )
    redraws: int = option(
        "N",
        "With --probability, where much is decided at the start: how often, at some levels, each game is tried with another start.",
        min=0,
        shows_default=True,
        default=0,
    )
    particles: int = option(
        "N",
        "With --probability: games at a time, of each repetition.",
        min=2,
        shows_default=True,
        default=100,
    )
    repetitions: int = option(
        "N", "With --probability: independent repetitions.", min=2, shows_default=True, default=20
    )
    directory: Path | None = option(
        "DIR",
        "Directory of the study; by default stress/NAME-HASH. The same command continues it.",
        "--out",
    )

    holds: float | None = option(
        "P",
        "End with exit code 6 unless the specification holds with 95 % confidence above this probability: 0.999.",
    )
    junit: Path | None = option(
        "FILE", "With --holds: write the answer as JUnit XML, for programs that run checks."
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.holds is not None and not 0.0 <= self.holds < 1.0:
            raise typer.BadParameter(
                f"--holds {self.holds:g} is not allowed; it takes a probability from 0 to less than 1"
            )
        if self.junit is not None and self.holds is None:
            raise typer.BadParameter("--junit needs --holds: the probability above which the test passes")
        if self.importance and (not self.probability or not self.vary or self.against is not None):
            raise typer.BadParameter(
                "--importance needs --probability, and --vary with distributions, as NAME='normal(10, 2)'; it does not compare missions"
            )
        if self.is_search and (self.probability or self.holds is not None):
            raise typer.BadParameter(
                "--probability and --holds are for one mission with one set of values; not with --vary and --against, but for --importance"
            )
        for name in ("guide", "redraws"):
            if getattr(self, name) and (not self.probability or self.importance):
                raise typer.BadParameter(f"--{name} needs --probability, without --importance")
        if not self.spec:
            raise typer.BadParameter(
                "--spec is missing: what must hold, such as 'always (distance(team 1, team 1) > 2 m)'"
            )

    @property
    def is_search(self) -> bool:
        """Values are searched, or two missions compared."""
        return (bool(self.vary) and not self.importance) or self.against is not None


@dataclass(frozen=True, kw_only=True)
class AnalyzeOptions:
    """Show who won a batch and how sure that is, how points differ, and which variables matter; of runs, their results and orders."""

    directories: list[Path] = argument(
        "BATCH|RUN",
        "A batch directory, complete or not; a run directory; or several runs, or folders of runs, whose operators are compared.",
    )
    quantities: list[str] = option(
        "EXPR",
        "Analyze this quantity: score[2], lost[1]/start[1], wins[2]-wins[3], t. Can be repeated; "
        "by default the scores, the entities left of each team, and the time at the end.",
        "--quantity",
        default=list,
    )
    compare: tuple[str, str] | None = option(
        "A B", "Compare, paired by seed, points with these numbers or values: tactic=keep tactic=switch."
    )
    target: str | None = option(
        "EXPR",
        "Show from which value on a mean reaches a target, for each choice, and which further runs would narrow it: "
        "'Guard.share >= 0.95'; by default the target of the command that played the batch.",
    )
    over: str | None = over_option()
    by_point: bool = flag("--by-point", "Show all points, not only twenty.")
    as_json: bool = flag("--json", "Print everything as JSON.")


@dataclass(frozen=True, kw_only=True)
class ReportOptions:
    """Write a page with the results of a batch: who won, what the varied values do, with plots as SVG and PNG."""

    batch: Path = argument("BATCH", "A batch directory, complete or not.")
    directory: Path | None = option(
        "DIR", "Directory for the page and its plots; by default BATCH/report.", "--out"
    )
    quantities: list[str] = option(
        "EXPR",
        "A quantity that gets its own plots, such as 'score[2]-score[3]' or t. Can be repeated.",
        "--quantity",
        default=list,
    )
    target: str | None = option(
        "EXPR",
        "Open with the answer to this question, as of tussle analyze; by default that of the command that played the batch.",
    )
    over: str | None = over_option()
