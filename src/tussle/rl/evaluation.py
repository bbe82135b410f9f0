"""Episodes that are played to see how good a policy is: what they earn, with its interval, and recordings of the best and the worst."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from tussle.rl.swarm import Swarm
from tussle.rl.task import Task

FIRST_SEED = 9_000_001
"""Of the episodes of evaluations, which no training plays: its seeds are hashes of 53 bits, or near its `seed`."""

Decide = Callable[[Swarm], np.ndarray]
"""Actions (W, A, n) for what the agents of a swarm see."""


def play_episodes(task: Task, decide: Decide, n: int) -> np.ndarray:
    """Play the first episode of each of n worlds. Returns the sum of its rewards, (n,)."""
    with Swarm(task, n, autoreset="disabled") as swarm:
        swarm.reset(FIRST_SEED)
        is_over, returns = np.zeros(n, bool), np.zeros(n)
        while not is_over.all():
            swarm.step(decide(swarm))
            returns += np.where(is_over, 0.0, swarm.rewards.sum(axis=1, dtype=float))
            is_over |= swarm.over
    return returns


def record_extremes(
    task: Task, decide: Decide, returns: np.ndarray, folder: Path, label: str
) -> dict[Path, float]:
    """Play the best and the worst of these episodes again, and record each as a run.

    Args:
        task: The task.
        decide: What played the episodes. What it decides for a world must not depend on the other worlds.
        returns: Of `play_episodes`.
        folder: Gets the run directories best-LABEL and worst-LABEL.
        label: Distinguishes them from those of other evaluations.

    Returns:
        The return of each, by its run directory.

    Raises:
        RecordError: A directory holds a run, or cannot be written.
    """
    from tussle.record import Recorder  # Arrow takes long to import

    found = {}
    for name, episode in {"best": int(returns.argmax()), "worst": int(returns.argmin())}.items():
        with Swarm(task, 1, autoreset="disabled") as swarm:
            swarm.reset(FIRST_SEED + episode)
            path, total = folder / f"{name}-{label}", 0.0
            with Recorder(swarm.simulation, path):
                while not swarm.over[0]:
                    swarm.step(decide(swarm))
                    total += float(swarm.rewards.sum(dtype=float))
        found[path] = total
    return found


def interval(returns: np.ndarray) -> tuple[float, float, float]:
    """Mean, and the ends of its 95 % confidence interval (Student's t)."""
    from scipy.stats import t as student_t  # it looks for PyTorch when it is imported

    mean, n = float(returns.mean()), len(returns)
    half = float(student_t.ppf(0.975, n - 1) * returns.std(ddof=1) / n**0.5) if n > 1 else np.inf
    return mean, mean - half, mean + half


class Board:
    """Writes the curve of a training for TensorBoard.

    Args:
        folder: Gets the event files.

    Raises:
        MissingExtraError: TensorBoard is not installed.
    """

    def __init__(self, folder: Path) -> None:
        from tussle.errors import MissingExtraError

        try:
            from torch.utils.tensorboard import SummaryWriter
        except ImportError:
            raise MissingExtraError(
                "--tensorboard needs TensorBoard: pip install 'tussle[tensorboard]'"
            ) from None
        self._writer: Any = SummaryWriter(str(folder))

    def add(self, line: dict[str, float]) -> None:
        """Add a line of the curve, over the number of decisions."""
        for name, value in line.items():
            if name != "decisions" and np.isfinite(value):
                self._writer.add_scalar(name, value, int(line["decisions"]))
        self._writer.flush()
