"""Errors of a page itself: told to who watches, while page and game go on."""

from __future__ import annotations

import contextlib
import traceback
from collections.abc import Awaitable, Callable, Iterator
from pathlib import Path
from typing import Any

from tussle.errors import TussleError

MOST_FAILURES = 20
"""That are listed."""
LONGEST = 300
"""Characters of one."""

Safe = Callable[[Callable[[Any], Any]], Callable[[Any], Awaitable[None]]]
"""Makes what a control does into a callback whose errors are told."""


class Failures:
    """A list of errors, each once.

    Attributes:
        texts: What went wrong, one line each.
        last: The last error; None while there was none.
    """

    def __init__(self) -> None:
        self.texts: list[str] = []
        self.last: BaseException | None = None

    def tell(self, error: BaseException) -> None:
        """Put an error on the list."""
        self.last = error
        text = _in_words(error)
        if text in self.texts or len(self.texts) > MOST_FAILURES:
            return
        is_full = len(self.texts) == MOST_FAILURES
        self.texts.append("further errors of the page are not listed" if is_full else text)

    @contextlib.contextmanager
    def caught(self) -> Iterator[None]:
        """What is done inside may fail: that is told, and what comes after is done."""
        try:
            yield
        except Exception as error:  # noqa: BLE001 - whatever it is, whoever watches reads it
            self.tell(error)

    def safe(self, do: Callable[[Any], Any]) -> Callable[[Any], Awaitable[None]]:
        """A callback that does this, and tells where it fails.

        It is asynchronous, so that what browsers send is done in its order, each with the value of its own.
        """

        async def told(event: Any) -> None:
            with self.caught():
                do(event)

        return told


def _in_words(error: BaseException) -> str:
    text = str(error)
    if not isinstance(error, TussleError):
        places = traceback.extract_tb(error.__traceback__)
        where = f" ({Path(places[-1].filename).name}:{places[-1].lineno})" if places else ""
        text = f"the page: {type(error).__name__}: {text[: LONGEST - 100]}{where}"
    return text[:LONGEST]
