"""Ctrl-C ends the step, not the program."""

from __future__ import annotations

import os
import signal
from types import FrameType
from typing import Any, Self

from tussle.cli.terminal import INTERRUPTED, TERMINATED, err


class Interrupt:
    """While it is open, SIGINT and SIGTERM only raise a flag; a second one stops the program at once.

    Attributes:
        code: Exit code of the first that came, 0 before.
    """

    def __init__(self) -> None:
        self.code = 0
        self._previous: dict[int, Any] = {}

    def __enter__(self) -> Self:
        for number in (signal.SIGINT, signal.SIGTERM):
            self._previous[number] = signal.signal(number, self._heard)
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._previous.items():
            signal.signal(number, handler)

    def _heard(self, number: int, _: FrameType | None) -> None:
        code = INTERRUPTED if number == signal.SIGINT else TERMINATED
        if self.code:
            # In the middle of a step there is no state worth recording; what has been flushed stays as it is.
            err().show_cursor(True)
            os.write(
                2, b"\nstopped in the middle of a step; what was recorded until the last flush is kept\n"
            )
            os._exit(code)
        self.code = code
