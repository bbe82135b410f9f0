"""Files that are written completely or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tussle.errors import ViewError


@contextmanager
def whole_file(path: Path, suffix: str = ".part") -> Iterator[Path]:
    """A temporary file with this suffix that replaces the file if nothing was raised, and is deleted else.

    Raises:
        ViewError: The file cannot be written.
    """
    part = path.with_name(f".{path.name}{suffix}")
    try:
        if path.is_dir():
            raise unwritable(path, "it is a directory")
        part.touch()
        yield part
        part.replace(path)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise unwritable(path, error) from error
    except BaseException:
        part.unlink(missing_ok=True)
        raise


def unwritable(path: Path, why: OSError | str) -> ViewError:
    """The error for a file that cannot be written."""
    if isinstance(why, OSError):
        why = os.strerror(why.errno) if why.errno else str(why)
    return ViewError(f"{path}: cannot be written: {why}")
