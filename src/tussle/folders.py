"""Folders of the user (XDG base directory specification), safe access to files in them, and locks between processes."""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]


def user_folder(variable: str, usual: str) -> Path | None:
    """Base folder for the user's files of one kind; None if the user has no home folder.

    Args:
        variable: Environment variable, such as "XDG_CACHE_HOME". An empty or relative value is ignored, as the specification says.
        usual: Default path, relative to the home folder.
    """
    chosen = Path(os.environ.get(variable, ""))
    if chosen.is_absolute():
        return chosen
    with suppress(RuntimeError):  # the home folder cannot be determined
        home = Path.home()
        return home / usual if home.is_absolute() else None
    return None


def real_path(path: Path) -> Path:
    """Absolute path with all links followed; where links lead to each other, one that cannot be opened.

    `Path.resolve` raises RuntimeError on such links before Python 3.13.
    """
    return Path(os.path.realpath(path))


def is_own(found: os.stat_result) -> bool:
    """Return True if a file belongs to the user and no other user can write it."""
    if not hasattr(os, "geteuid"):  # Windows: the access lists of the user's folders keep other users out
        return True
    return found.st_uid == os.geteuid() and not found.st_mode & (stat.S_IWGRP | stat.S_IWOTH)


def is_private(folder: Path) -> bool:
    """Return True if a path is a folder that belongs to the user and that no other user can write to."""
    try:
        found = folder.stat()
    except OSError:
        return False
    return stat.S_ISDIR(found.st_mode) and is_own(found)


def open_safely(path: Path, flags: int, mode: int = 0o600) -> int:
    """Open a file without following a link and without waiting for a pipe; returns its descriptor.

    Raises:
        OSError: The file cannot be opened, or is a link.
    """
    names = ("O_NOFOLLOW", "O_NONBLOCK", "O_BINARY")  # not all of them exist on all systems
    return os.open(path, flags | sum(getattr(os, name, 0) for name in names), mode)


def lock(file: IO[Any], *, wait: bool) -> None:
    """Lock a file for this process until the file is closed.

    Raises:
        BlockingIOError: Another process holds the lock, and `wait` is false.
        OSError: The system or the file system has no locks.
    """
    if fcntl is None:
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))
    fcntl.flock(file, fcntl.LOCK_EX if wait else fcntl.LOCK_EX | fcntl.LOCK_NB)


@contextmanager
def whole_file(path: Path, suffix: str = ".part") -> Iterator[Path]:
    """A temporary file with this suffix that replaces the file if nothing was raised, and is deleted else.

    Raises:
        OSError: The file cannot be written, or there is a folder, a device, a pipe or a link, none of which is replaced.
    """
    if os.path.lexists(path) and not stat.S_ISREG(path.lstat().st_mode):
        raise OSError(f"it is {'a directory' if path.is_dir() else 'no regular file'}")
    part = path.with_name(f".{path.name}{suffix}")
    try:
        part.unlink(missing_ok=True)
        part.touch()
        yield part
        part.replace(path)
    except BaseException:
        with suppress(OSError):
            part.unlink(missing_ok=True)
        raise


def read_own(path: Path) -> tuple[bytes, float]:
    """Content and modification time [s] of a file that only the user can write.

    Raises:
        OSError: The file cannot be read, is a link, or can be written by another user.
    """
    handle = open_safely(path, os.O_RDONLY)
    with os.fdopen(handle, "rb") as file:
        found = os.fstat(handle)
        if not (stat.S_ISREG(found.st_mode) and is_own(found)):
            raise PermissionError(f"{path}: it is not a regular file that only this user can write")
        return file.read(), found.st_mtime
