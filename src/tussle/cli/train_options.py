"""Options of `tussle train` and `tussle league`."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

from tussle.cli.options import MAX_SEED, PluginOptions, argument, check_positive, flag, option


@dataclass(frozen=True, kw_only=True)
class TrainOptions(PluginOptions):
    """Train a policy for a task by PPO, or one for each role, and write them as ONNX for the autonomy Learned."""

    task: Annotated[
        str,
        argument(
            "TASK", "Registered id of a task, such as tussle/PredatorTeam-v0; --plugin-path adds yours."
        ),
    ]
    minutes: Annotated[
        float, option("MIN", "Wall time to train, with --resume including that before.", shows_default=True)
    ] = 10.0
    seed: Annotated[
        int,
        option("N", "Seed of worlds, weights and exploration.", min=0, max=MAX_SEED // 2, shows_default=True),
    ] = 1
    worlds: Annotated[
        int | None, option("N", "Worlds that play at once, 32 by default; same as --set worlds=N.", min=1)
    ] = None
    settings_file: Annotated[
        Path | None, option("FILE", "TOML file of settings: learning_rate = 3e-4.", "--settings")
    ] = None
    settings: Annotated[
        list[str],
        option(
            "NAME=VALUE",
            "Setting, instead of that of the file: learning_rate=3e-4, entropy=0.01, critic=central, memory=32, evaluate_every=10. Can be "
            "repeated.",
            "--set",
        ),
    ] = field(default_factory=list)
    directory: Annotated[
        Path | None,
        option(
            "DIR",
            "Gets the policies, curve.png, curve.csv, evaluations.csv and checkpoint.pt; by default training/NAME.",
            "--out",
        ),
    ] = None
    against: Annotated[
        str | None,
        option(
            "POOL",
            "Who plays the other side, instead of its rules; each episode draws one of latest (the policy in training), past (earlier "
            "ones) and ONNX files or folders: latest=4,past=4,best.onnx=2, where the numbers are shares.",
        ),
    ] = None
    resume: Annotated[bool, flag("--resume", "Continue from the checkpoint of the directory.")] = False
    episodes: Annotated[
        bool,
        flag(
            "--record-episodes",
            "At the end, play evaluate_episodes episodes and record the best and the worst, for `tussle replay`.",
        ),
    ] = False
    board: Annotated[
        bool, flag("--tensorboard", "Write the curve for TensorBoard to DIR/tensorboard as well.")
    ] = False

    def __post_init__(self) -> None:
        check_positive(minutes=self.minutes)


@dataclass(frozen=True, kw_only=True)
class LeagueOptions(PluginOptions):
    """Let rules and policies play each other at a task, and rate them: a table, and a page with replays of the deciding games."""

    task: Annotated[
        str,
        argument(
            "TASK",
            "Registered id of a task with two sides, such as tussle/Battle-v0; --plugin-path adds yours.",
        ),
    ]
    players: Annotated[
        str,
        option(
            "PLAYERS",
            "Who plays, separated by commas: rules (the autonomies of the mission), ONNX files, NAME=FILE, and NAME=rules.",
        ),
    ]
    games: Annotated[
        int,
        option(
            "N",
            "Games of each pair, half on each side where one policy can play both.",
            min=1,
            shows_default=True,
        ),
    ] = 40
    seed: Annotated[
        int,
        option(
            "N",
            "Seed of the first game; the others follow it.",
            min=0,
            max=MAX_SEED // 2,
            shows_default=True,
        ),
    ] = 1
    processes: Annotated[int | None, option("N", "Number of processes; by default one per core.", min=1)] = (
        None
    )
    stack: Annotated[
        int | None,
        option("N", "Games played side by side in each process; by default chosen by the mission.", min=1),
    ] = None
    directory: Annotated[
        Path | None,
        option(
            "DIR",
            "Gets the games, league.html, league.json and the replays; by default leagues/NAME. Its games are not repeated.",
            "--out",
            "-o",
        ),
    ] = None
    as_json: Annotated[bool, flag("--json", "Print everything as JSON.")] = False
