"""Copies of plugin files in a run directory, with which its mission can be read and played again."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

from tussle.errors import MissionError, RecordError
from tussle.folders import real_path
from tussle.mission import PluginFile

PLUGINS = "plugins"
FOLDER = re.compile(r"(\d{1,6})-(.+)", re.DOTALL)
"""A folder for each file, as two files may have one name: its place in the order, and its name without an ending."""


def plugin_copies(files: Iterable[PluginFile]) -> dict[str, str]:
    """Path in a run directory -> text, of plugin files and the neighbours that they import."""
    return {
        f"{PLUGINS}/{i}-{Path(file.name).stem}/{name}": text
        for i, file in enumerate(files)
        for name, text in file.texts.items()
    }


def copied_plugins(directory: Path) -> tuple[PluginFile, ...]:
    """The plugin files that a run directory holds, in order; they are read and not run.

    Raises:
        RecordError: A file cannot be read, or a link leads out of the directory.
    """
    folders = [(FOLDER.fullmatch(path.name), path) for path in (directory / PLUGINS).glob("*-*")]
    found = sorted((int(match[1]), path / f"{match[2]}.py") for match, path in folders if match)
    try:
        files = tuple(PluginFile.of(path) for _, path in found)
        home = real_path(directory) / PLUGINS
        for (_, path), file in zip(found, files, strict=True):
            for name in (path.name, *file.texts):
                if not real_path(path.parent / name).is_relative_to(home):
                    raise RecordError(
                        f"{path.parent / name} leads out of the run directory, so it is not read"
                    )
    except (MissionError, OSError, RuntimeError) as error:  # RuntimeError: links in a circle
        raise RecordError(f"{directory}: its plugin files cannot be read: {error}") from None
    return files
