"""Makes the picture of docs/world.md: python tests/docs/world_picture.py."""

from __future__ import annotations

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import PolyCollection

from tussle import Simulation
from tussle.mission import read_mission

IMAGE = Path(__file__).resolve().parents[2] / "docs" / "images" / "world.png"


def main() -> None:
    """Play the mission car_maze, and draw paths and one scan from above."""
    simulation = Simulation(read_mission("car_maze").mission)
    path = [simulation.read("cars.pos")[0][0]]
    while not simulation.is_over:
        simulation.step()
        path.append(simulation.read("cars.pos")[0][0])
    figure, axes = plt.subplots(figsize=(6.4, 6.0), layout="constrained")
    for wall in simulation.mission.scene.walls:
        axes.add_collection(PolyCollection(wall.triangles()[:, :, :2], facecolor="0.55", edgecolor="0.55"))
    axes.plot(*np.moveaxis(np.array(path)[:, :, :2], -1, 0), linewidth=0.8)
    pos, yaw = path[-1][0], simulation.read("cars.yaw")[0][0, 0]
    x, y, _, _, in_range = simulation.read("cars.RayTrace.points")[0][0, 0]
    x, y = x[in_range > 0], y[in_range > 0]
    east, north = pos[0] + x * np.cos(yaw) - y * np.sin(yaw), pos[1] + x * np.sin(yaw) + y * np.cos(yaw)
    axes.plot([0.0 * east + pos[0], east], [0.0 * north + pos[1], north], color="tab:red", linewidth=0.3)
    axes.plot(east, north, ".", color="tab:red", markersize=3)
    axes.plot(path[-1][:, 0], path[-1][:, 1], "ko", markersize=5)
    axes.set(aspect="equal", xlabel="East [m]", ylabel="North [m]")
    figure.savefig(IMAGE, dpi=110)


if __name__ == "__main__":
    main()
