"""Errors of the page itself. They are shown on the page; page and game continue."""

from __future__ import annotations

import contextlib
import traceback
from collections.abc import Iterator
from pathlib import Path

from tussle.errors import TussleError

MAX_FAILURES = 20
"""Largest number of listed failures."""
MAX_TEXT = 300
"""Characters of one."""


class Failures:
    """A list of distinct errors.

    Attributes:
        texts: What went wrong, one line each.
        last: The last error; None while there was none.
    """

    def __init__(self) -> None:
        self.texts: list[str] = []
        self.last: BaseException | None = None

    def tell(self, error: BaseException) -> str:
        """Add an error to the list and return its line."""
        self.last = error
        text = _in_words(error)
        if text not in self.texts and len(self.texts) <= MAX_FAILURES:
            is_full = len(self.texts) == MAX_FAILURES
            self.texts.append("further errors of the page are not listed" if is_full else text)
        return text

    @contextlib.contextmanager
    def caught(self) -> Iterator[None]:
        """Catch and report an error inside; execution continues after the block."""
        try:
            yield
        except Exception as error:  # noqa: BLE001 - whatever it is, whoever watches reads it
            self.tell(error)


def _in_words(error: BaseException) -> str:
    text = str(error)
    if not isinstance(error, TussleError):
        places = traceback.extract_tb(error.__traceback__)
        where = f" ({Path(places[-1].filename).name}:{places[-1].lineno})" if places else ""
        text = f"the page: {type(error).__name__}: {text[: MAX_TEXT - 100]}{where}"
    return text[:MAX_TEXT]
