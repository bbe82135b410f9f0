"""Files that a mission names without a path, such as scripts of aircraft and maps: they are found in folders of data."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePath

from tussle.declare.texts import shown
from tussle.errors import MissingFileError

VARIABLE = "SCRIMMAGE_DATA_PATH"
"""Environment variable with folders of data, separated as in PATH, which SCRIMMAGE's users have."""


def data_folders(search: Iterable[str | Path]) -> list[Path]:
    """Return the folders of data: those given, then those of the environment."""
    named = os.environ.get(VARIABLE, "").split(os.pathsep)
    return [Path(os.path.expanduser(folder)) for folder in (*search, *filter(None, named))]  # noqa: PTH111


@dataclass(frozen=True)
class DataFiles:
    """Finds files as SCRIMMAGE does: by their names, at any depth.

    Attributes:
        beside: The mission's folder, in which no deeper folder is searched.
        folders: Folders of data; the first that has the file counts.
    """

    beside: Path
    folders: Sequence[Path]

    def find(self, name: str) -> Path:
        """Return the file that a mission names.

        That is the path itself, else the file beside the mission, else that of a folder of data which ends with this path, else with
        this file name. Of several in one folder it is the least deep, and then the first in the order of the alphabet.

        Raises:
            MissingFileError: There is none.
        """
        path = Path(os.path.expanduser(name.replace("\0", "")))  # noqa: PTH111
        for direct in (path, self.beside / path, *(folder / path for folder in self.folders)):
            if direct.is_file():
                return direct.absolute()
        for parts in (path.parts, path.parts[-1:]):
            for folder in self.folders:
                same = [file for file in _named(folder, path.name) if file.parts[-len(parts) :] == parts]
                if same:
                    return folder.absolute() / min(same, key=lambda file: (len(file.parts), file))
        where = ", ".join(map(str, self.folders)) or "a folder of data"
        raise MissingFileError(
            f"there is no file {shown(name)} beside the mission or in {where}; --data-path DIR (search=[DIR]) or the environment "
            f"variable {VARIABLE} names the folder that has it"
        )


def _named(folder: Path, name: str) -> list[PurePath]:
    """Paths of the files of this name below a folder, from there."""
    found = (root for root, _, names in os.walk(folder) if name in names)
    return [PurePath(root, name).relative_to(folder) for root in found]
