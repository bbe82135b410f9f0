"""Files that are there whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tussle.errors import ViewError


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """A file to write instead of another, whose place it takes when all went well.

    Raises:
        ViewError: It cannot be written.
    """
    part = path.with_name(f".{path.name}.part")
    try:
        if path.is_dir():
            raise unwritable(path, "it is a directory")
        yield part
        part.replace(path)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise unwritable(path, error) from error
    except BaseException:
        part.unlink(missing_ok=True)
        raise


def unwritable(path: Path, why: OSError | str) -> ViewError:
    """The error of a file that cannot be written."""
    if isinstance(why, OSError):
        why = os.strerror(why.errno) if why.errno else str(why)
    return ViewError(f"{path}: cannot be written: {why}")
