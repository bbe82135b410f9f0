"""Files that are written completely or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tussle import folders
from tussle.errors import ViewError


@contextmanager
def whole_file(path: Path, suffix: str = ".part") -> Iterator[Path]:
    """`tussle.folders.whole_file` for a file that the user asked for.

    Raises:
        ViewError: The file cannot be written.
    """
    try:
        with folders.whole_file(path, suffix) as part:
            yield part
    except OSError as error:
        raise unwritable(path, error) from error


def unwritable(path: Path, why: OSError | str) -> ViewError:
    """The error for a file that cannot be written."""
    if isinstance(why, OSError):
        why = os.strerror(why.errno) if why.errno else str(why)
    return ViewError(f"{path}: cannot be written: {why}")
