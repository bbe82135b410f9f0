"""Speed of making a film of a recorded run without a display.

    python benchmarks/film.py [--sizes 20 200 2000] [--repeats 3] [--json FILE]

Sizes are entities in two flocks, filmed at 1280x720 in H.264 with trails, shadows and caption, with each offscreen window type that
works on this machine. `pictures/s` is per wall time, with planning and the final wait for the encoder. `CPU ms` is CPU time of this
process per picture, in which Mesa draws with all cores. Other load on the machine affects all columns but the last.
"""

from __future__ import annotations

import os
import tempfile
import time
from functools import partial
from pathlib import Path
from typing import Any

import measuring

from tussle import Block, Mission, Recorder, Simulation
from tussle.stock import Boids, Unicycle
from tussle.view import Recording
from tussle.view.export.film import FilmOptions, write_film
from tussle.view.export.film.renderer import LIBRARIES, WINDOW_VARIABLE, is_installed

SIZES = (20, 200, 2000)
SECONDS = 6.0
"""Duration of the films [s]."""


def recorded(n: int, folder: Path) -> Recording:
    """Two flocks, for the duration of the film."""
    blocks = [
        Block(
            name=name, team=team, count=n // 2, position=(x, 0, 150), placement="uniform", half_width=(80, 80, 50),
            autonomy=Boids(), motion=Unicycle(vel_max=20),
        )
        for name, team, x in (("west", 1, -150), ("east", 2, 150))
    ]  # fmt: skip
    simulation = Simulation(Mission(blocks=blocks, end=SECONDS))
    with Recorder(simulation, folder):
        simulation.run()
    return Recording(folder)


def measure(recording: Recording, n: int, window: str, folder: Path) -> dict[str, Any]:
    """Film once."""
    os.environ[WINDOW_VARIABLE] = window
    cpu, wall = time.process_time(), time.perf_counter()
    report = write_film(recording, mp4=folder / "film.mp4", options=FilmOptions(speed=1.0))
    cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
    each = 1000.0 / report.n_pictures
    return {
        "entities": n,
        "window": window.removeprefix("vtk").removesuffix("RenderWindow"),
        "pictures/s": report.n_pictures / wall,
        "CPU ms": cpu * each,
        "MB": (folder / "film.mp4").stat().st_size / 1e6,
    }


def main() -> None:
    asked = measuring.arguments(__doc__, SIZES)
    windows = [name for name, libraries in LIBRARIES.items() if any(map(is_installed, libraries))]
    rows = []
    with tempfile.TemporaryDirectory() as name:
        for n in asked.sizes:
            recording = recorded(n, Path(name) / str(n))
            for window in windows:
                once = partial(measure, recording, n, window, Path(name))
                rows += [measuring.median_of(asked.repeats, once, "pictures/s")]
    measuring.report(f"films of {SECONDS:g} s at 1280x720", rows, asked.json)


if __name__ == "__main__":
    main()
