"""Compiled kernels on disk: one file per kernel and key, written whole or not at all, old ones of the same name removed."""

from __future__ import annotations

import hashlib
import os
import pickle
import re
import tempfile
import time
import warnings
from functools import cache
from pathlib import Path
from typing import Any

KEEP = 8  # files per name: a few variants of the code, and of the processor settings that tests use
TOUCH_AFTER = (
    86400.0  # [s] a file in use is marked as such once a day, so that the removal takes the unused ones
)


def directory() -> Path:
    """Where compiled kernels are kept: $TUSSLE_CACHE_DIR, else a folder in $NUMBA_CACHE_DIR, else in the user's cache folder."""
    if chosen := os.environ.get("TUSSLE_CACHE_DIR"):
        return Path(chosen)
    if shared := os.environ.get("NUMBA_CACHE_DIR"):
        return Path(shared) / "tussle"
    from numba.misc.appdirs import AppDirs

    return Path(AppDirs(appname="tussle", appauthor=False).user_cache_dir) / "kernels"


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
        content = path.read_bytes()
        if time.time() - path.stat().st_mtime > TOUCH_AFTER:
            os.utime(path)
    except OSError:
        return None
    digest, data = content[:32], content[32:]
    if hashlib.sha256(data).digest() != digest:  # a damaged file: running its machine code could do anything
        return None
    return pickle.loads(data)  # noqa: S301 - the folder is the user's own, and holds machine code anyway


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
        warn_unwritable(str(folder), str(error))
        return
    remove_old(folder, stem)


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
def warn_unwritable(folder: str, why: str) -> None:
    """Say once per folder that nothing is kept."""
    warnings.warn(
        f"compiled kernels cannot be kept in {folder} ({why}): they compile anew in every process; "
        "set TUSSLE_CACHE_DIR to a writable folder",
        RuntimeWarning,
        stacklevel=2,
    )
