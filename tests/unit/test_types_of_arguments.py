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
from tussle.api import MotionModel, State
from tussle.scene import Cuboid, HeightField, Origin, Plane, Polyhedron, Prism, Scene, Sphere, TriangleMesh
from tussle.stock import Boids, Unicycle

class Spring(MotionModel):
    x = State("x v", unit="m m/s")

    @staticmethod
    def derivative(x: float, v: float) -> tuple[float, float]:
        return v, -x

shapes = [Sphere([0, 0, 1], 2.0), Plane([0, 0, 0], [0, 0, 1]), Polyhedron([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])]
mesh = TriangleMesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], faces=[(0, 1, 2)])
hills = HeightField([[0.0, 1.0], [2, 3]])
places = Origin.from_degrees(50, 10).to_geodetic([1.0, 2.0, 3.0])
walls = [Cuboid((0.0, 0.0, 0.0), [1, 1.0, 1.0]), Prism([(0, 0), (1, 0), (0, 1)])]
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
    assert "wrong" in TEXT.splitlines()[int(errors[0].split(":")[1]) - 1]
