"""Tells the user's own code in batch directories from foreign code, by hashes that are kept in the user's state folder."""

from __future__ import annotations

import hashlib
import warnings
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from tussle.folders import is_private, read_own, real_path, user_folder
from tussle.mission import PluginFile


@dataclass(frozen=True)
class DirectoryCode:
    """The plugin files of a batch directory, as they were read.

    Attributes:
        path: The batch directory.
        files: The files, each with the neighbours that it imports.
    """

    path: Path
    files: tuple[PluginFile, ...]

    @property
    def is_own(self) -> bool:
        """True if the directory has no code, or only code that this user has given to a batch before."""
        return not self.files or _is_known(digest(self.files))

    def __str__(self) -> str:
        home = real_path(self.path)
        texts = {Path(file.folder, name): text for file in self.files for name, text in file.texts.items()}
        return ", ".join(
            f"{self.path / path.relative_to(home)} ({len(text):,} characters)" for path, text in texts.items()
        )


def digest(files: Iterable[PluginFile]) -> str:
    """Hash of plugin files in their order, wherever they lie."""
    contents = [(file.name, sorted(file.texts.items())) for file in files]
    return hashlib.blake2b(repr(contents).encode(), digest_size=32).hexdigest()


def remember(files: Iterable[PluginFile]) -> None:
    """Record that the user gave these plugin files to a batch."""
    file = _file(digest(files))
    try:
        if file is None:
            raise OSError("this user has no home")
        file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        if not is_private(file.parent):
            raise PermissionError(f"{file.parent} must belong to you, and nobody else may write into it")
        file.touch(mode=0o600)
    except OSError as error:
        warnings.warn(
            f"it cannot be noted that these plugin files are yours ({error}): to play a run of this batch again takes --trust",
            RuntimeWarning,
            stacklevel=2,
        )


def _is_known(code: str) -> bool:
    file = _file(code)
    if file is None or not is_private(file.parent):
        return False
    try:
        read_own(file)
    except OSError:
        return False
    return True


def _file(code: str) -> Path | None:
    folder = user_folder("XDG_STATE_HOME", ".local/state")
    return None if folder is None else folder / "tussle" / f"code-{code}"
