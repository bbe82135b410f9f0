"""The map of the code names what is there."""

from __future__ import annotations

import re

from pages import ROOT
from rooms import PICTURE, picture

TEXT = (ROOT / "docs/architecture.md").read_text()


def test_every_file_and_folder_that_it_names_exists():
    named = set(re.findall(r"(?:src|tests)/[\w/.]+", TEXT))
    named |= {
        f"src/tussle/{name}"
        for name in re.findall(r"(?<![\w/])(?:engine|api|plugins|numeric|declare)/[\w./]+", TEXT)
    }
    assert len(named) > 20
    assert not [name for name in named if not (ROOT / name.rstrip(".")).exists()]


def test_every_package_and_single_module_is_on_it():
    packages = {path.parent.name for path in (ROOT / "src/tussle").glob("*/__init__.py")}
    assert not [name for name in packages if f"| `{name}` |" not in TEXT]
    modules = {path.stem for path in (ROOT / "src/tussle").glob("*.py")} - {"__init__"}
    assert not [name for name in modules if f"`{name}`" not in TEXT]


def test_the_picture_shows_the_imports():
    """`python tests/docs/rewrite.py` draws it again."""
    assert PICTURE.read_text() == picture()
