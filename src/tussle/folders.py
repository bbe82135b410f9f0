"""Folders of the user's own, where the XDG base directory specification puts them, and whether nobody else writes into them."""

from __future__ import annotations

import os
import stat
from contextlib import suppress
from pathlib import Path


def user_folder(variable: str, usual: str) -> Path | None:
    """Where all programs of the user keep things of a kind; None where the user has no home.

    Args:
        variable: Of the environment, such as "XDG_CACHE_HOME". An empty or relative value is ignored, as the specification says.
        usual: Otherwise, below the home.
    """
    chosen = Path(os.environ.get(variable, ""))
    if chosen.is_absolute():
        return chosen
    with suppress(RuntimeError):  # a user without a name
        home = Path.home()
        return home / usual if home.is_absolute() else None
    return None


def is_own(found: os.stat_result) -> bool:
    """It belongs to the user, and nobody else may write it."""
    return found.st_uid == os.geteuid() and not found.st_mode & (stat.S_IWGRP | stat.S_IWOTH)


def is_private(folder: Path) -> bool:
    """It is a folder of the user's own, into which nobody else writes."""
    try:
        found = folder.stat()
    except OSError:
        return False
    return stat.S_ISDIR(found.st_mode) and is_own(found)


def read_own(path: Path) -> tuple[bytes, float]:
    """Content of a file of the user's own, and when it was written [s].

    Raises:
        OSError: It cannot be read, is a link, or somebody else may have written it.
    """
    handle = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
    with os.fdopen(handle, "rb") as file:
        found = os.fstat(handle)
        if not (stat.S_ISREG(found.st_mode) and is_own(found)):
            raise PermissionError(f"{path}: it is no file of this user alone")
        return file.read(), found.st_mtime
