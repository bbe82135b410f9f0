"""`tussle train`: train a policy, show its progress, and draw its curve."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tussle.cli.interrupt import Interrupt
from tussle.cli.options import read_settings
from tussle.cli.progress import compiling
from tussle.cli.terminal import OK, out, say
from tussle.cli.train_options import TrainOptions
from tussle.errors import ParameterError
from tussle.mission.plugin_files import load_plugin_file


def train(options: TrainOptions) -> int:
    """Train, or continue.

    Returns:
        The exit code.

    Raises:
        MissingExtraError: PyTorch, or TensorBoard if it is asked for, is not installed.
        ParameterError: The task is unknown, or the directory has a checkpoint that would be overwritten, or none to continue from.
    """
    from tussle.rl.evaluation import Board, record_extremes
    from tussle.rl.flight import registered_task
    from tussle.rl.opponents import Pool
    from tussle.rl.settings import Settings, read_training
    from tussle.rl.train import Trainer  # needs the packages of tussle[train]

    for path in options.plugin_files:
        load_plugin_file(path)
    task = registered_task(options.task, "TASK")
    folder = options.directory or Path("training") / options.task.rpartition("/")[2]
    if (folder / "checkpoint.pt").exists() and not options.resume:
        raise ParameterError(f"{folder} has a checkpoint; continue it with --resume, or choose another --out")
    settings = Settings()
    given: list[tuple[str, dict[str, Any]]] = [("--set", dict(read_settings(options.settings)))]
    if options.worlds is not None:
        given.append(("--worlds", {"worlds": options.worlds}))
    if options.settings_file is not None:
        given.insert(0, (str(options.settings_file), read_training(options.settings_file)))
    for where, values in given:
        settings = settings.replaced(values, where)
    pool = None
    if options.against is not None:
        entries = options.against.split(",")
        first = folder / "policy.onnx"
        pool = Pool(options.task, task, folder / "pool", entries, options.seed, first, settings.memory)
        task = pool.task
    with compiling():
        trainer = Trainer(task, options.task, folder, options.seed, settings)
    if options.resume:
        trainer.resume()
    board = Board(folder / "tensorboard") if options.board else None
    with Interrupt() as interrupt:

        def tell(line: dict[str, float]) -> bool:
            out().print(
                f"{line['minutes']:6.1f} min  {line['decisions']:>13,.0f} decisions  {line['episodes']:>6,.0f} episodes  "
                f"return {line['episode_return']:10.2f}  reward {line['reward_per_decision']:10.5f}"
            )
            if "evaluated" in line:
                out().print(
                    f"           evaluated: return {line['evaluated']:.2f}, 95 % interval {line['low']:.2f} to {line['high']:.2f}"
                )
            if board is not None:
                board.add(line)
            if pool is not None:
                pool.add(trainer.model.layers(), len(trainer.curve))
            return bool(interrupt.code)

        trainer.train(options.minutes, tell)
    draw_curve(trainer.curve, trainer.evaluations, folder / "curve.png", options.task)
    for name, path in trainer.files.items():
        block = f' block="{task.roles[name][0]}"' if name else ""
        say("trained", f'{path}: <autonomy policy="{path}"{block}>Learned</autonomy>', "bold green")
    if options.episodes:
        returns, label = trainer.evaluate(), str(trainer.n_decisions)
        for path, found in record_extremes(task, trainer.decide, returns, folder, label).items():
            say("recorded", f"{path}: return {found:.2f}; tussle replay {path}")
    return interrupt.code or OK


def draw_curve(
    curve: Sequence[Sequence[float]], evaluations: Sequence[Sequence[float]], path: Path, title: str
) -> None:
    """Draw reward per decision, returns of episodes, and evaluations with their intervals over decisions."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    from tussle.rl.policy_file import kept_file

    figure = Figure(figsize=(7, 5), layout="constrained")
    FigureCanvasAgg(figure)
    upper, lower = figure.subplots(2, sharex=True)
    decisions = [line[1] for line in curve]
    upper.plot(decisions, [line[4] for line in curve])
    lower.plot(decisions, [line[3] for line in curve], ".-", label="training")
    if evaluations:
        _, at, _, mean, low, high = zip(*evaluations, strict=True)
        errors = [
            [m - x for m, x in zip(mean, low, strict=True)],
            [x - m for m, x in zip(mean, high, strict=True)],
        ]
        lower.errorbar(at, mean, errors, fmt="o", capsize=3, label="evaluation, 95 %")
        lower.legend()
    upper.set(title=title, ylabel="reward per decision")
    lower.set(xlabel="decisions", ylabel="return of an episode")
    with kept_file(path) as part:
        figure.savefig(part, dpi=120, format="png")
