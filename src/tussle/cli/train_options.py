"""Options of `tussle train`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tussle.cli.options import LARGEST_SEED, PluginOptions, argument, check_positive, flag, option


@dataclass(frozen=True, kw_only=True)
class TrainOptions(PluginOptions):
    """Train a policy for a task by PPO, shared by all agents, and write it as ONNX for the autonomy Learned."""

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
        option(
            "N", "Seed of worlds, weights and exploration.", min=0, max=LARGEST_SEED // 2, shows_default=True
        ),
    ] = 1
    worlds: Annotated[int, option("N", "Worlds that play at once.", min=1, shows_default=True)] = 32
    directory: Annotated[
        Path | None,
        option(
            "DIR",
            "Gets policy.onnx, curve.png, curve.csv and checkpoint.pt; by default training/NAME.",
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

    def __post_init__(self) -> None:
        check_positive(minutes=self.minutes)
