"""Progress of a long call in a notebook's cell; nothing elsewhere. The commands of tussle have bars of their own."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from html import escape
from multiprocessing import parent_process
from typing import Any
from uuid import uuid4

MIN_DURATION = 1.0
"""Calls that end earlier show no bar [s]."""
UPDATE_PERIOD = 0.2
"""Least time between two updates of a bar [s]."""

Show = Callable[[float, float, str], None]
"""Takes the amount done, the amount at the end (inf if unknown), and their unit with whatever else is to be said."""


@contextmanager
def notebook_bar(name: str) -> Iterator[Show | None]:
    """Give what shows the progress of a task in the cell that runs, None outside notebooks. The bar is taken away at the end.

    The bar is HTML that Jupyter's protocol replaces, so it needs no extension of the notebook. It has a text for programs without HTML.

    Args:
        name: Name of the task.
    """
    publish = _publisher()
    if publish is None:
        yield None
        return
    due, is_shown, transient = time.monotonic() + MIN_DURATION, False, {"display_id": uuid4().hex}

    def show(done: float, total: float, text: str) -> None:
        nonlocal due, is_shown
        now = time.monotonic()
        if now < due:
            return
        due = now + UPDATE_PERIOD
        is_known = math.isfinite(total) and total > 0.0
        amount = f"{done:,.0f}/{total:,.10g}" if is_known else f"{done:,.0f}"
        line = f"{name}: {amount} {text}"
        value = f' value="{min(done / total, 1.0):.4f}"' if is_known else ""
        bar = f'<progress{value} style="width: 20em; vertical-align: middle"></progress> {escape(line)}'
        publish({"text/plain": line, "text/html": bar}, transient=transient, update=is_shown)
        is_shown = True

    try:
        yield show
    finally:
        if is_shown:
            publish({"text/plain": "", "text/html": ""}, transient=transient, update=True)


def _publisher() -> Callable[..., Any] | None:
    """Return the function of IPython that sends to the cell that runs; None outside notebooks, and in processes that they started."""
    ipython = sys.modules.get("IPython")
    shell = None if ipython is None or parent_process() is not None else ipython.get_ipython()
    # The shell of a terminal has no kernel, and would print each update on a line of its own.
    if shell is None or getattr(shell, "kernel", None) is None:
        return None
    publish: Callable[..., Any] = shell.display_pub.publish
    return publish
