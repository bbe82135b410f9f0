"""How far something is that is counted: a bar on a terminal, a line now and then elsewhere."""

from __future__ import annotations

import time
from typing import Self

from rich.progress import BarColumn, Progress

from tussle.cli.progress import BAR_EVERY, LINE_EVERY, clock, text_column
from tussle.cli.terminal import err


class Tally:
    """Shows how many are done, how fast, and how long it will take.

    Args:
        name: What is being made.
        things: What is counted, such as "pictures".
    """

    def __init__(self, name: str, things: str) -> None:
        self._name, self._things = name, things
        self._began = time.perf_counter()
        self._is_bar = err().is_terminal
        self._due = self._began + (0.0 if self._is_bar else LINE_EVERY)
        self._bar = Progress(
            text_column("{task.description}", style="bold"),
            BarColumn(bar_width=None, complete_style="cyan", finished_style="cyan", pulse_style="cyan"),
            text_column("{task.fields[at]}"),
            text_column("{task.fields[left]}", style="dim"),
            console=err(), auto_refresh=False, transient=True, expand=True,
        )  # fmt: skip
        self._task = self._bar.add_task(name, total=None, at="", left="")

    def __enter__(self) -> Self:
        if self._is_bar:
            self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._is_bar:
            self._bar.stop()

    def show(self, done: int, total: int | None = None) -> None:
        """So many are done; returns at once unless there is something to show."""
        now = time.perf_counter()
        if now < self._due:
            return
        self._due = now + (BAR_EVERY if self._is_bar else LINE_EVERY)
        rate = done / max(now - self._began, 1e-9)
        at = f"{done:,}/{total:,} {self._things}" if total is not None else f"{done:,} {self._things}"
        left = "" if total is None or rate <= 0.0 else clock((total - done) / rate) + " left"
        if self._is_bar:
            self._bar.update(self._task, completed=done, total=total, at=at, left=left, refresh=True)
        else:
            err().print(f"{self._name}: {at}" + (f", {left}" if left else ""))
