"""Handling of Ctrl-C and SIGTERM: finish the current step, then stop."""

from __future__ import annotations

import os
import signal
from types import FrameType
from typing import Any, Self

from tussle.cli.terminal import INTERRUPTED, TERMINATED, err


class Interrupted(Exception):  # noqa: N818 - not an error
    """The user asked to stop."""


class Interrupt:
    """A context in which SIGINT and SIGTERM set a flag; a second signal stops the program at once.

    Attributes:
        code: Exit code of the first signal; 0 before.
    """

    def __init__(self) -> None:
        self.code = 0
        self._previous: dict[int, Any] = {}

    def __enter__(self) -> Self:
        for number in (signal.SIGINT, signal.SIGTERM):
            self._previous[number] = signal.signal(number, self._handle)
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._previous.items():
            signal.signal(number, handler)

    def check(self) -> None:
        """Stop if a signal has come.

        Raises:
            Interrupted: A signal has come.
        """
        if self.code:
            raise Interrupted

    def _handle(self, number: int, _: FrameType | None) -> None:
        code = INTERRUPTED if number == signal.SIGINT else TERMINATED
        if self.code:
            # The state in the middle of a step is not recorded; flushed data remains.
            err().show_cursor(True)
            os.write(2, b"\nstopped in the middle of a step; the recording up to the last flush is kept\n")
            os._exit(code)
        self.code = code
