"""Mission files to write and to find."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from tussle.mission import Loaded, read_mission

ENTITY = """
  <entity>
    <name>a</name>
    {inside}
    <motion_model>SingleIntegrator</motion_model>
    <controller>SingleIntegratorControllerSimple</controller>
    <autonomy>Boids</autonomy>
  </entity>"""


class Writer:
    """Writes mission files into a folder and reads them."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def write(self, text: str | bytes, name: str = "m.xml") -> Path:
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(text.encode() if isinstance(text, str) else text)
        return path

    def read(self, text: str, overrides: dict[str, str] | None = None, **options: object) -> Loaded:
        """A whole mission text."""
        return read_mission(self.write(text), overrides, **options)

    def world(
        self, tags: str = "", inside: str = "", overrides: dict[str, str] | None = None, **options: object
    ) -> Loaded:
        """A mission with one block `a`, further tags of the world and of the entity."""
        text = f"<runscript name='t'>\n{tags}{ENTITY.format(inside=inside)}\n</runscript>"
        return self.read(text, overrides, **options)

    def entity(self, inside: str, **options: object):
        """The block of a mission with one entity."""
        return self.read(
            f"<runscript>\n<entity>\n{inside}\n</entity>\n</runscript>", **options
        ).mission.blocks[0]


@pytest.fixture
def files(tmp_path: Path) -> Writer:
    return Writer(tmp_path)


@pytest.fixture(scope="session")
def existing() -> Callable[[str], Path]:
    """Finds SCRIMMAGE's missions: below $TUSSLE_RECORDINGS, else in a folder beside the repository; skips without."""
    named = os.environ.get("TUSSLE_RECORDINGS")
    beside = sorted(Path(__file__).resolve().parents[4].iterdir())
    folders = (
        [Path(named)]
        if named
        else [p for p in beside if (p / "missions").is_dir() and (p / "truth").is_dir()]
    )

    def find(name: str) -> Path:
        if not folders:
            pytest.skip("needs recordings of SCRIMMAGE beside the repository, or TUSSLE_RECORDINGS")
        return folders[0] / "missions" / name

    return find
