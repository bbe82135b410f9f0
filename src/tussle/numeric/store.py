"""Disk cache of compiled kernels: one file per kernel and key, written atomically. Old files of the same kernel are removed.

A wheel brings some along, which are only read.
"""

from __future__ import annotations

import atexit
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

from tussle.folders import is_private, lock, open_safely, read_own, user_folder

KEEP = 8  # files per kernel: a few variants of the code and of the processor settings that tests use
SHIPPED = Path(__file__).with_name("shipped")
"""Kernels that came with the package: a wheel has those of its missions, see hatch_build.py."""
TOUCH_TIME = (
    86400.0  # [s] the time stamp of a used file is renewed once a day, so that unused files are removed first
)


def directory() -> Path:
    """Cache folder: $TUSSLE_CACHE_DIR, else a folder in $NUMBA_CACHE_DIR, else in the user's cache folder.

    The files are machine code, so the folder must belong to the user and be writable only by the user. If it is not, or there is
    no absolute path to it, a folder for temporary files is used instead.
    """
    chosen = _chosen()
    # In this order: another process may make the folder in between.
    if chosen is not None and (not os.path.lexists(chosen) or is_private(chosen)):
        return chosen
    warn_once(
        f"compiled kernels are not stored in {chosen or 'your home folder'}: the folder must belong to you and be writable only by "
        "you; a temporary folder is used instead; set TUSSLE_CACHE_DIR to choose another"
    )
    shared = (
        Path(tempfile.gettempdir()) / f"tussle-{os.geteuid() if hasattr(os, 'geteuid') else 'cache'}"
    )  # used by all workers of a batch
    with suppress(OSError):
        shared.mkdir(mode=0o700)
    return shared if is_private(shared) and not shared.is_symlink() else _temporary_folder()


def _chosen() -> Path | None:
    for variable, inner in (("TUSSLE_CACHE_DIR", ""), ("NUMBA_CACHE_DIR", "tussle")):
        if (path := Path(os.environ.get(variable, ""))).is_absolute():
            return path / inner
        if path.parts:
            warn_once(f"{variable}={path} is ignored: it must be an absolute path")
    caches = user_folder("XDG_CACHE_HOME", ".cache")
    return None if caches is None else caches / "tussle" / "kernels"


@cache
def _temporary_folder() -> Path:
    """Temporary folder of this process, removed at exit."""
    folder = tempfile.mkdtemp(prefix="tussle-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return Path(folder)


def file_stem(name: str) -> str:
    """Convert a kernel name to the start of a file name; long names are cut and get a hash."""
    plain = re.sub(r"[^A-Za-z0-9_.]", "_", name)
    return (
        plain
        if len(plain) <= 120
        else f"{plain[:100]}_{hashlib.blake2b(name.encode(), digest_size=6).hexdigest()}"
    )


def load(name: str, key: str) -> Any:
    """Load what was saved under a name and key, or came with the package; None if there is no file, or it is unreadable or damaged."""
    file_name = f"{file_stem(name)}-{key}.kernel"
    path = directory() / file_name
    try:
        content, written = read_own(path)
        if time.time() - written > TOUCH_TIME:
            os.utime(path)
    except OSError:
        content = b""
    return _unpacked(content) or _unpacked(_shipped(file_name))


def _unpacked(content: bytes) -> Any:
    """The data of a file; None if the file is empty or damaged."""
    digest, data = content[:32], content[32:]
    if hashlib.sha256(data).digest() != digest:  # damaged: its machine code must not run
        return None
    return pickle.loads(data)  # noqa: S301 - the user's own file in a folder of the user's own, or a part of the package


def _shipped(file_name: str) -> bytes:
    """Content of a file of the kernels that came with the package, which is as much trusted as its code; empty if there is none."""
    try:
        return (SHIPPED / file_name).read_bytes()
    except OSError:
        return b""


def save(name: str, key: str, data: bytes) -> None:
    """Save pickled data under a name and key. Concurrent processes are safe: each writes its own file and renames it."""
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
            f"compiled kernels cannot be stored in {folder} ({error}): every process compiles them again; "
            "set TUSSLE_CACHE_DIR to a writable folder"
        )
        return
    remove_old(folder, stem)


@contextmanager
def compile_lock(name: str, key: str) -> Iterator[None]:
    """Lock between processes: one compiles the kernel of this name and key, the others wait and load it."""
    path = directory() / f".{file_stem(name)}-{key}.lock"
    try:
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        handle = open_safely(path, os.O_CREAT | os.O_RDWR)
    except OSError:  # nothing can be stored; `save` warns
        yield
        return
    try:
        with os.fdopen(handle, "r+b") as file:
            with suppress(OSError):  # without locks, each process compiles the kernel
                lock(file, wait=True)
            yield
    finally:
        with suppress(OSError):  # removed by another process, or, on Windows, still open there
            path.unlink()


def remove_old(folder: Path, stem: str) -> None:
    """Remove all but the KEEP most recently used files of one kernel."""
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
    """Issue a warning once per process."""
    warnings.warn(text, RuntimeWarning, stacklevel=3)
