"""Options of `tussle train` and `tussle league`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from tussle.cli.options import MAX_SEED, PluginOptions, argument, check_positive, flag, option


@dataclass(frozen=True, kw_only=True)
class TrainOptions(PluginOptions):
    """Train a policy for a task by PPO, or one for each role, and write them as ONNX for the autonomy Learned."""

    task: str = argument(
        "TASK", "Registered id of a task, such as tussle/PredatorTeam-v0; --plugin-path adds yours."
    )
    minutes: float = option(
        "MIN", "Wall time to train, with --resume including that before.", shows_default=True, default=10.0
    )
    seed: int = option(
        "N",
        "Seed of worlds, weights and exploration.",
        min=0,
        max=MAX_SEED // 2,
        shows_default=True,
        default=1,
    )
    worlds: int | None = option(
        "N", "Worlds that play at once, 32 by default; same as --set worlds=N.", min=1
    )
    settings_file: Path | None = option("FILE", "TOML file of settings: learning_rate = 3e-4.", "--settings")
    settings: list[str] = option(
        "NAME=VALUE",
        "Setting, instead of that of the file: learning_rate=3e-4, entropy=0.01, critic=central, memory=32, evaluate_every=10. Can be "
        "repeated.",
        "--set",
        default=list,
    )
    directory: Path | None = option(
        "DIR",
        "Gets the policies, curve.png, curve.csv, evaluations.csv and checkpoint.pt; by default training/NAME.",
        "--out",
    )
    against: str | None = option(
        "POOL",
        "Who plays the other side, instead of its rules; each episode draws one of latest (the policy in training), past (earlier "
        "ones) and ONNX files or folders: latest=4,past=4,best.onnx=2, where the numbers are shares.",
    )
    resume: bool = flag("--resume", "Continue from the checkpoint of the directory.")
    episodes: bool = flag(
        "--record-episodes",
        "At the end, play evaluate_episodes episodes and record the best and the worst, for `tussle replay`.",
    )
    board: bool = flag("--tensorboard", "Write the curve for TensorBoard to DIR/tensorboard as well.")

    def __post_init__(self) -> None:
        check_positive(minutes=self.minutes)


@dataclass(frozen=True, kw_only=True)
class LeagueOptions(PluginOptions):
    """Let rules and policies play each other at a task, and rate them: a table, and a page with replays of the deciding games."""

    task: str = argument(
        "TASK",
        "Registered id of a task with two sides, such as tussle/Battle-v0; --plugin-path adds yours.",
    )
    players: str = option(
        "PLAYERS",
        "Who plays, separated by commas: rules (the autonomies of the mission), ONNX files, NAME=FILE, and NAME=rules.",
        default=...,
    )
    games: int = option(
        "N",
        "Games of each pair, half on each side where one policy can play both.",
        min=1,
        shows_default=True,
        default=40,
    )
    seed: int = option(
        "N",
        "Seed of the first game; the others follow it.",
        min=0,
        max=MAX_SEED // 2,
        shows_default=True,
        default=1,
    )
    processes: int | None = option("N", "Number of processes; by default one per core.", min=1)
    stack: int | None = option(
        "N", "Games played side by side in each process; by default chosen by the mission.", min=1
    )
    directory: Path | None = option(
        "DIR",
        "Gets the games, league.html, league.json and the replays; by default leagues/NAME. Its games are not repeated.",
        "--out",
        "-o",
    )
    as_json: bool = flag("--json", "Print everything as JSON.")
