"""The cost of a watched page: CPU time of the server, frames per second, and speed of the game.

    python benchmarks/view.py [--sizes 2000 20000] [--repeats 1] [--json FILE]

Sizes are numbers of Boids, at the density of `scale.py`. The viewer is a process that speaks the page's protocol and draws nothing, because
a browser without a graphics card would take CPU time from the measurement. Per size:

* paced: the game at 60 steps per second. `page` is the CPU time of the server threads (all but the game's) and `frames` the number of
  frames received, both per wall second.
* free: as fast as possible. `speed` is steps per CPU second of the game's thread with a viewer and rewind history, relative to the same
  steps without a page.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import measuring
import scale

from tussle import Mission, Simulation
from tussle.view import Live
from tussle.view.page.server import Page

SIZES = (2000, 20000)
SECONDS = 8.0
STEPS_A_SECOND = 60.0
CLIENT = Path(__file__).resolve().parents[1] / "tests" / "unit" / "view"
WATCH = """
import sys, time
sys.path.insert(0, sys.argv[2])
from page_client import PageClient
client = PageClient(sys.argv[1], is_counting=True)
for line in sys.stdin:
    print(client.n_frames, client.n_bytes, flush=True)
"""


def boids(n: int) -> Mission:
    """A game that does not end during the measurement."""
    return scale.mission(n).replace(end=1e6)


class Watcher:
    """A separate process that receives everything the page sends."""

    def __init__(self, url: str) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-c", WATCH, url, str(CLIENT)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def received(self) -> tuple[int, int]:
        """Frames and bytes received so far."""
        assert self._process.stdin
        assert self._process.stdout
        self._process.stdin.write("\n")
        self._process.stdin.flush()
        frames, size = self._process.stdout.readline().split()
        return int(frames), int(size)

    def close(self) -> None:
        self._process.kill()
        self._process.wait()


def cpu_by_thread() -> dict[str, float]:
    """CPU seconds of the game's thread and of all other threads."""
    tick = os.sysconf("SC_CLK_TCK")
    names = {thread.native_id: thread.name for thread in threading.enumerate()}
    spent = {"game": 0.0, "page": 0.0}
    for task in Path("/proc/self/task").iterdir():
        fields = (task / "stat").read_text().rpartition(")")[2].split()
        is_game = names.get(int(task.name)) == "tussle live"
        spent["game" if is_game else "page"] += (int(fields[11]) + int(fields[12])) / tick
    return spent


def between(seconds: float) -> dict[str, float]:
    """CPU seconds per wall second, over some seconds."""
    first, began = cpu_by_thread(), time.perf_counter()
    time.sleep(seconds)
    wall = time.perf_counter() - began
    return {name: (value - first[name]) / wall for name, value in cpu_by_thread().items()}


def paced(simulation: Simulation) -> dict[str, float]:
    """CPU time of the page while the game is paced."""
    with Live(simulation, pace=STEPS_A_SECOND * simulation.mission.dt) as live, Page(live) as page:
        time.sleep(2.0)
        alone = between(SECONDS / 2)
        watcher = Watcher(page.url)
        while not page.n_readers:
            time.sleep(0.1)
        time.sleep(2.0)
        (frames, size), began, pushed = watcher.received(), time.perf_counter(), page.publisher.n_made
        watched = between(SECONDS)
        (frames2, size2), wall = watcher.received(), time.perf_counter() - began
        watcher.close()
        return {
            "page_cpu": watched["page"] - alone["page"],
            "game_cpu_alone": alone["game"],
            "game_cpu_watched": watched["game"],
            "pushed": (page.publisher.n_made - pushed) / wall,
            "frames": (frames2 - frames) / wall,
            "MB_per_s": (size2 - size) / wall / 1e6,
            "steps_per_s": live.steps_per_second,
        }


def free(n: int) -> dict[str, float]:
    """Steps per CPU second with a viewer, relative to the same steps without."""
    with (
        Simulation(boids(n), 1) as simulation,
        Live(simulation, pace=None) as live,
        Page(live) as page,
    ):
        watcher = Watcher(page.url)
        while not page.n_readers or live.step_number < 5:
            time.sleep(0.1)
        first, began, pushed, wall = (
            live.step_number,
            cpu_by_thread(),
            page.publisher.n_made,
            time.perf_counter(),
        )
        time.sleep(SECONDS)
        last, watched = live.step_number, cpu_by_thread()["game"] - began["game"]
        rate = (page.publisher.n_made - pushed) / (time.perf_counter() - wall)
        watcher.close()
    with Simulation(boids(n), 1) as simulation:
        simulation.step(first)
        alone = time.process_time()
        simulation.step(last - first)
        return {"speed": (time.process_time() - alone) / watched, "free_pushed": rate}


def measure(n: int, repeats: int) -> dict[str, Any]:
    rows = []
    for _ in range(repeats):
        with Simulation(boids(n), 1) as simulation:
            simulation.step(2)
            rows.append(paced(simulation) | free(n))
    return {"n": n, **{name: statistics.median(row[name] for row in rows) for name in rows[0]}}


def main() -> None:
    args = measuring.arguments(__doc__.splitlines()[0], SIZES)
    measuring.report(
        "A page that somebody watches, by entities (n)",
        [measure(n, args.repeats) for n in args.sizes],
        args.json,
    )


if __name__ == "__main__":
    main()
