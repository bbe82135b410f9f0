"""Makes the picture of docs/ros.md: python tests/docs/ros_picture.py, while roscore runs."""

from __future__ import annotations

import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import PolyCollection

from tussle import Simulation
from tussle.mission import read_mission
from tussle.plugins.links.ros.node import DEBIAN

ROOT = Path(__file__).resolve().parents[2]
IMAGE = ROOT / "docs" / "images" / "ros_maze.png"
GOALS = (
    [(0.0, 60.0), (66.0, 66.0)],
    [(0.0, -20.0), (66.0, -66.0)],
    [(0.0, -60.0), (-66.0, -66.0)],
    [(0.0, 20.0), (-66.0, 66.0)],
)
AS_MAIN = (
    f"import runpy, sys; sys.path.append({DEBIAN!r}); runpy.run_path(sys.argv.pop(1), run_name='__main__')"
)


def main() -> None:
    """Play the mission of the page with four clients, and draw the paths from above."""
    path = []
    with ExitStack() as stack:
        for i, goals in enumerate(GOALS, 1):
            script = str(ROOT / "examples" / "ros" / "navigate.py")
            arguments = [script, f"__ns:=/entity{i}", f"_goals:={[list(goal) for goal in goals]}"]
            node = stack.enter_context(subprocess.Popen([sys.executable, "-c", AS_MAIN, *arguments]))
            stack.callback(node.terminate)
        simulation = stack.enter_context(
            Simulation(read_mission(ROOT / "examples" / "ros" / "maze.xml").mission)
        )
        while not simulation.is_over:
            simulation.step()
            path.append(np.concatenate([simulation.read(f"{name}.pos")[0][0] for name in ("west", "east")]))
    figure, axes = plt.subplots(figsize=(6.4, 6.0), layout="constrained")
    for wall in simulation.mission.scene.walls:
        axes.add_collection(PolyCollection(wall.triangles()[:, :, :2], facecolor="0.55", edgecolor="0.55"))
    for i, goals in enumerate(GOALS):
        line = np.array(path)[:, i, :2]
        (drawn,) = axes.plot(*line.T, linewidth=1.2, label=f"entity{i + 1}")
        axes.plot(*line[0], "o", color=drawn.get_color(), markersize=6)
        axes.plot(*np.array(goals).T, "*", color=drawn.get_color(), markersize=12)
    axes.set(aspect="equal", xlabel="East [m]", ylabel="North [m]")
    axes.legend(loc="lower center", ncols=4, fontsize="small", bbox_to_anchor=(0.5, 1.0))
    figure.savefig(IMAGE, dpi=100)


if __name__ == "__main__":
    main()
