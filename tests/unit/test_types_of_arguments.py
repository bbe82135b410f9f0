"""A type checker accepts the arguments that missions and scenes accept."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import tussle

TEXT = """
from tussle import Block, Mission
from tussle.scene import Cuboid, Scene
from tussle.stock import Boids, Unicycle

walls = [Cuboid((0.0, 0.0, 0.0), (1.0, 1.0, 1.0))]
block = Block(name="red", position=[1.0, 2, 0.0], velocity=[1, 0, 0], autonomy=Boids(), motion=Unicycle())
mission = Mission(blocks=[block], scene=Scene(walls=walls, bases=[], meshes=[]))
wrong = Scene(walls=3)
"""


@pytest.mark.slow
def test_sequences_of_any_kind_are_accepted(tmp_path):
    file = tmp_path / "mine.py"
    file.write_text(TEXT)
    home = Path(tussle.__file__).parents[1]  # mypy finds what is installed by itself, and refuses to be told
    environment = os.environ | ({} if home.name == "site-packages" else {"MYPYPATH": str(home)})
    command = [sys.executable, "-m", "mypy", "--strict", "--cache-dir", str(tmp_path / "cache"), file.name]
    done = subprocess.run(command, check=False, cwd=tmp_path, env=environment, capture_output=True, text=True)
    errors = [line for line in done.stdout.splitlines() if line.startswith("mine.py") and ": error:" in line]
    assert len(errors) == 1, done.stdout + done.stderr
    assert errors[0].startswith("mine.py:9: ")
