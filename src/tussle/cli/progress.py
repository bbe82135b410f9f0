"""Progress of a game, an export and kernel compilation: a bar on a terminal, lines in a log."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Self

from rich.console import Group
from rich.live import Live
from rich.progress import BarColumn, Progress, TextColumn
from rich.status import Status
from rich.text import Text

from tussle.cli.terminal import err
from tussle.numeric import kernel, store

BAR_PERIOD = 0.1  # [s] between updates of a bar
LINE_PERIOD = 10.0  # [s] between lines in a log


def text_column(template: str, style: str = "none") -> TextColumn:
    """Return a column of a bar that shows its text without interpreting markup."""
    return TextColumn(template, style, markup=False)


class ProgressMeter:
    """Shows the progress of a task, its speed and the time left: a bar on a terminal, a line every 10 s elsewhere.

    Args:
        name: Name of the task.
        unit: Unit of the amount done, such as "s" or "states".
        start: Amount done at the start.
        speed_unit: Unit of the amount done per second of wall time; if empty, the speed is not shown.

    Attributes:
        before: Amount that was done before the task began, and does not count for the speed.
    """

    def __init__(self, name: str, unit: str, start: float = 0.0, speed_unit: str = "") -> None:
        self._name, self._unit, self._start, self._speed_unit = name, unit, start, speed_unit
        self.before = start
        self._began = time.perf_counter()
        self._is_bar = err().is_terminal
        self._due = self._began + (0.0 if self._is_bar else LINE_PERIOD)
        self._bar = Progress(
            text_column("{task.description}", style="bold"),
            BarColumn(bar_width=None, complete_style="cyan", finished_style="cyan", pulse_style="cyan"),
            text_column("{task.fields[at]}"),
            text_column("{task.fields[speed]}", style="cyan"),
            text_column("{task.fields[left]}", style="dim"),
            auto_refresh=False, expand=True,
        )  # fmt: skip
        self._task = self._bar.add_task(name, total=None, at="", speed="", left="")
        self._live = Live(self._bar, console=err(), auto_refresh=False, transient=True)

    def __enter__(self) -> Self:
        if self._is_bar:
            self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._is_bar:
            self._live.stop()

    def show(
        self,
        done: float,
        total: float | None = None,
        *,
        n_finished: int | None = None,
        result: Callable[[], str] | None = None,
    ) -> None:
        """Show the amount done, of a total if it is known. Returns at once if an update is not due.

        Args:
            done: Amount done.
            total: Amount at the end.
            n_finished: Number that is shown instead of the amount done, if this also counts parts of what is in progress.
            result: Returns the result so far, which is shown below the bar.
        """
        now = time.perf_counter()
        if now < self._due:
            return
        self._due = now + (BAR_PERIOD if self._is_bar else LINE_PERIOD)
        rate = (done - self.before) / max(now - self._began, 1e-9)
        shown = done if n_finished is None else n_finished
        at = f"{shown:,.0f}" + ("" if total is None else f"/{total:,.10g}") + f" {self._unit}"
        speed = f"{times(rate)} {self._speed_unit}" if self._speed_unit else ""
        left = "" if total is None or rate <= 0.0 else f"{clock(max(0.0, total - done) / rate)} left"
        below = result() if result else ""
        if self._is_bar:
            span = None if total is None else total - self._start
            self._bar.update(
                self._task, completed=done - self._start, total=span, at=at, speed=speed, left=left
            )
            parts = [self._bar, Text(below, style="dim")] if below else [self._bar]
            self._live.update(Group(*parts), refresh=True)
        else:
            texts = [text for text in (at, speed, left, below) if text]
            err().print(f"{self._name}: " + ", ".join(texts), soft_wrap=True)


def times(factor: float) -> str:
    """Format a ratio: "0.042", "3.1", "52", "1,280"."""
    if factor >= 100.0:
        return f"{factor:,.0f}"
    return f"{factor:.3g}"


def clock(seconds: float) -> str:
    """Format a duration [s]: "0:07", "12:00", "3:00:00"."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"


@contextmanager
def compiling() -> Iterator[None]:
    """Show which kernels are compiled inside; nothing if all are loaded from disk."""
    console, began, names = err(), time.perf_counter(), []
    status = Status("", console=console)

    def show(name: str) -> None:
        names.append(name)
        if len(names) == 1:
            console.print(
                f"compiling kernels for this machine; they are cached in {home_short(store.directory())}",
                soft_wrap=True,
            )
        if console.is_terminal:
            status.start()
            status.update(
                Text(f"{len(names)}  {name.removeprefix('tussle.').removeprefix('plugins.stock.')}")
            )

    before, kernel.stats.on_compile = kernel.stats.on_compile, show
    try:
        yield
    finally:
        kernel.stats.on_compile = before
        status.stop()
    if names:
        n = f"{len(names)} kernels" if len(names) > 1 else "1 kernel"
        console.print(f"compiled {n} in {time.perf_counter() - began:.1f} s")


def home_short(path: Path) -> str:
    """Abbreviate the user's home directory in a path as ~."""
    try:
        return f"~/{path.relative_to(Path.home())}"
    except (ValueError, RuntimeError):
        return str(path)
