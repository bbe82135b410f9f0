"""Paths of the files of aircraft, engines and systems."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

from tussle.aircraft.node import AircraftError, Element, read_file
from tussle.errors import clipped, nearest_name

FOLDERS = {
    "engine": ("", "Engines", "Engine", "engine", "engines"),
    "system": ("", "Systems", "systems"),
    "part": ("",),
}
NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.+ -]*(/[A-Za-z0-9_][A-Za-z0-9_.+ -]*){0,3}")
MAX_FILES = 200


def package_root() -> Path:
    """The folder of aircraft, engine and systems of the installed package jsbsim.

    Raises:
        AircraftError: It is not installed.
    """
    found = importlib.util.find_spec("jsbsim")
    if found is None or found.origin is None:
        raise AircraftError(
            "the package jsbsim with its aircraft is not installed: pip install 'tussle[jsbsim]', or name a jsbsim_root"
        )
    for folder in (Path(found.origin).parent / "jsbsim", Path(found.origin).parent):
        if (folder / "aircraft").is_dir():
            return folder
    raise AircraftError(f"the package jsbsim in {Path(found.origin).parent} has no folder of aircraft")


class Files:
    """The files of one aircraft.

    Args:
        root: Folder of aircraft, engine and systems; None for that of the package jsbsim.
        aircraft: Name of the aircraft.

    Raises:
        AircraftError: There is no such aircraft.
    """

    def __init__(self, root: Path | None, aircraft: str) -> None:
        self.root = package_root() if root is None else root
        if not NAME.fullmatch(aircraft) or "/" in aircraft:
            raise AircraftError(f"aircraft {clipped(aircraft)!r} is no name of an aircraft")
        self.folder = self.root / "aircraft" / aircraft
        self.path = self.folder / f"{aircraft}.xml"
        self.read: list[Path] = []
        if not self.path.is_file():
            known = [each.name for each in (self.root / "aircraft").glob("*") if each.is_dir()]
            raise AircraftError(f"{self.path}: there is no such aircraft{nearest_name(aircraft, known)}")

    def load(self) -> Element:
        """Read the aircraft's file.

        Raises:
            AircraftError: It cannot be read.
        """
        return self._read(self.path)

    def _read(self, path: Path) -> Element:
        self.read.append(path)
        if len(self.read) > MAX_FILES:
            raise AircraftError(f"{path}: the aircraft has more than {MAX_FILES} files")
        return read_file(path)

    def find(self, node: Element, name: str, kind: str) -> Element:
        """Read the file that an element names; `kind` is "engine", "system" or "part".

        Raises:
            AircraftError: There is none, or it lies outside the folders.
        """
        name = name.strip()
        if not NAME.fullmatch(name):
            raise node.error(f"{clipped(name)!r} is no name of a file below the aircraft's folder")
        name = name if name.endswith(".xml") else f"{name}.xml"
        common = {"engine": self.root / "engine", "system": self.root / "systems", "part": self.folder}[kind]
        for folder in (*(self.folder / each for each in FOLDERS[kind]), common):
            if (folder / name).is_file():
                return self._read(folder / name)
        raise node.error(f"there is no file {name} in {self.folder} or {common}")
