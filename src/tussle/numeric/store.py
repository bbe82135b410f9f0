"""Compiled kernels on disk: one file per kernel and key, written whole or not at all, old ones of the same name removed."""

from __future__ import annotations

import atexit
import fcntl
import hashlib
import os
import pickle
import re
import shutil
import tempfile
import time
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any

from tussle.folders import is_private, read_own, user_folder

KEEP = 8  # files per name: a few variants of the code, and of the processor settings that tests use
TOUCH_AFTER = (
    86400.0  # [s] a file in use is marked as such once a day, so that the removal takes the unused ones
)


def directory() -> Path:
    """Where compiled kernels are kept: $TUSSLE_CACHE_DIR, else a folder in $NUMBA_CACHE_DIR, else in the user's cache folder.

    What is kept is machine code, so the folder is the user's own and nobody else writes into it: otherwise, and without an absolute
    path, a folder for temporary files takes its place.
    """
    chosen = _chosen()
    if chosen is not None and (is_private(chosen) or not os.path.lexists(chosen)):
        return chosen
    warn_once(
        f"compiled kernels are not kept in {chosen or 'the home of this user'}: the folder must belong to you, and nobody else may "
        "write into it; a temporary one is used instead, and TUSSLE_CACHE_DIR chooses another"
    )
    shared = (
        Path(tempfile.gettempdir()) / f"tussle-{os.geteuid()}"
    )  # the workers of a batch have it in common
    with suppress(OSError):
        shared.mkdir(mode=0o700)
    return shared if is_private(shared) and not shared.is_symlink() else _only_now()


def _chosen() -> Path | None:
    for variable, inner in (("TUSSLE_CACHE_DIR", ""), ("NUMBA_CACHE_DIR", "tussle")):
        if (path := Path(os.environ.get(variable, ""))).is_absolute():
            return path / inner
        if path.parts:
            warn_once(f"{variable}={path} is ignored: it takes an absolute path")
    caches = user_folder("XDG_CACHE_HOME", ".cache")
    return None if caches is None else caches / "tussle" / "kernels"


@cache
def _only_now() -> Path:
    """A folder for this process, removed at its end."""
    folder = tempfile.mkdtemp(prefix="tussle-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return Path(folder)


def file_stem(name: str) -> str:
    """The name as the beginning of a file name; long ones are cut and told apart by a hash."""
    plain = re.sub(r"[^A-Za-z0-9_.]", "_", name)
    return (
        plain
        if len(plain) <= 120
        else f"{plain[:100]}_{hashlib.blake2b(name.encode(), digest_size=6).hexdigest()}"
    )


def load(name: str, key: str) -> Any:
    """What was saved under the name and key; None where there is nothing, or nothing readable."""
    path = directory() / f"{file_stem(name)}-{key}.kernel"
    try:
        content, written = read_own(path)
        if time.time() - written > TOUCH_AFTER:
            os.utime(path)
    except OSError:
        return None
    digest, data = content[:32], content[32:]
    if hashlib.sha256(data).digest() != digest:  # a damaged file: running its machine code could do anything
        return None
    return pickle.loads(data)  # noqa: S301 - the user's own file in a folder of the user's own


def save(name: str, key: str, data: bytes) -> None:
    """Keep pickled data under the name and key. Several processes may do so at once: each writes its own file and renames it."""
    folder = directory()
    stem = file_stem(name)
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        handle, temporary = tempfile.mkstemp(prefix=".", suffix=".tmp", dir=folder)
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(hashlib.sha256(data).digest() + data)
            Path(temporary).replace(folder / f"{stem}-{key}.kernel")
        except BaseException:
            Path(temporary).unlink()
            raise
    except OSError as error:
        warn_once(
            f"compiled kernels cannot be kept in {folder} ({error}): they compile anew in every process; "
            "set TUSSLE_CACHE_DIR to a writable folder"
        )
        return
    remove_old(folder, stem)


@contextmanager
def compile_lock(name: str, key: str) -> Iterator[None]:
    """A lock between processes: one compiles what is kept under the name and key, the others wait and load it."""
    path = directory() / f".{file_stem(name)}-{key}.lock"
    try:
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        handle = os.open(path, os.O_CREAT | os.O_RDWR | os.O_CLOEXEC, 0o600)
    except OSError:  # nothing can be kept, and `save` says so
        yield
        return
    try:
        fcntl.flock(handle, fcntl.LOCK_EX)  # of a process that ends, the system takes it back
        yield
    finally:
        path.unlink(missing_ok=True)  # those who wait hold it open
        os.close(handle)


def remove_old(folder: Path, stem: str) -> None:
    """Remove the files of one kernel that were unused for longest, beyond KEEP."""
    found = []
    pattern = re.compile(re.escape(stem) + r"-[0-9a-f]{32}\.kernel")
    for path in folder.iterdir():
        if pattern.fullmatch(path.name):
            try:
                found.append((path.stat().st_mtime, path))
            except OSError:  # another process has just removed it
                continue
    for _, path in sorted(found, reverse=True)[KEEP:]:
        path.unlink(missing_ok=True)


@cache
def warn_once(text: str) -> None:
    """Say what the user should know of where kernels are kept."""
    warnings.warn(text, RuntimeWarning, stacklevel=3)
