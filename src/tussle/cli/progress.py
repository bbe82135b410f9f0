"""How far a game is: a bar on a terminal, a line now and then elsewhere; what is being compiled."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Self

from rich.progress import BarColumn, Progress, TextColumn
from rich.status import Status
from rich.text import Text

from tussle.cli.terminal import err
from tussle.numeric import kernel, store

BAR_EVERY = 0.1  # [s] faster is not seen
LINE_EVERY = 10.0  # [s] of a log that somebody reads later


def text_column(template: str, style: str = "none") -> TextColumn:
    """A column of a bar, in which names of files and missions are no markup."""
    return TextColumn(template, style, markup=False)


class Meter:
    """Shows how far a game is and how fast it goes.

    Args:
        name: Of the mission.
        start: Time at which it is measured from [s].
        end: Time at which the game ends [s]; None where it has no such time.
    """

    def __init__(self, name: str, start: float, end: float | None) -> None:
        self.start, self.end = start, end
        self._began = time.perf_counter()
        self._is_bar = err().is_terminal
        self._due = self._began + (0.0 if self._is_bar else LINE_EVERY)
        self._bar = Progress(
            text_column("{task.description}", style="bold"),
            BarColumn(bar_width=None, complete_style="cyan", finished_style="cyan", pulse_style="cyan"),
            text_column("{task.fields[at]}"),
            text_column("{task.fields[speed]}", style="cyan"),
            text_column("{task.fields[left]}", style="dim"),
            console=err(), auto_refresh=False, transient=True, expand=True,
        )  # fmt: skip
        total = None if end is None else end - start
        self._task = self._bar.add_task(name, total=total, at="", speed="", left="")

    def __enter__(self) -> Self:
        if self._is_bar:
            self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._is_bar:
            self._bar.stop()

    def show(self, t: float) -> None:
        """The game is at time t [s]; returns at once unless there is something to show."""
        now = time.perf_counter()
        if now < self._due:
            return
        self._due = now + (BAR_EVERY if self._is_bar else LINE_EVERY)
        speed = (t - self.start) / max(now - self._began, 1e-9)
        at = f"{t:.0f} s" if self.end is None else f"{t:.0f}/{self.end:g} s"
        ratio = f"{times(speed)} × real time"
        if not self._is_bar:
            err().print(f"t = {at}, {ratio}")
            return
        left = "" if self.end is None or speed <= 0.0 else clock((self.end - t) / speed) + " left"
        self._bar.update(self._task, completed=t - self.start, at=at, speed=ratio, left=left, refresh=True)


def times(factor: float) -> str:
    """A ratio with the digits that count: "0.042", "3.1", "52", "1,280"."""
    if factor >= 100.0:
        return f"{factor:,.0f}"
    return f"{factor:.3g}"


def clock(seconds: float) -> str:
    """A duration as a clock shows it: "0:07", "12:00", "3:00:00"."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"


@contextmanager
def compiling() -> Iterator[None]:
    """Says what the user waits for while kernels are compiled inside; nothing where all of them come from disk."""
    console, began, names = err(), time.perf_counter(), []
    status = Status("", console=console)

    def tell(name: str) -> None:
        names.append(name)
        if len(names) == 1:
            console.print(
                f"compiling kernels for this machine, once; they are kept in {home_short(store.directory())}",
                soft_wrap=True,
            )
        if console.is_terminal:
            status.start()
            status.update(Text(f"{len(names)}  {name.removeprefix('tussle.').removeprefix('stock.')}"))

    before, kernel.stats.on_compile = kernel.stats.on_compile, tell
    try:
        yield
    finally:
        kernel.stats.on_compile = before
        status.stop()
    if names:
        n = f"{len(names)} kernels" if len(names) > 1 else "1 kernel"
        console.print(f"compiled {n} in {time.perf_counter() - began:.1f} s")


def home_short(path: Path) -> str:
    """A path with ~ for the user's home."""
    try:
        return f"~/{path.relative_to(Path.home())}"
    except (ValueError, RuntimeError):
        return str(path)
