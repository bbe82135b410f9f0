"""Makes the picture of docs/world.md: python tests/docs/world_picture.py."""

from __future__ import annotations

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import PolyCollection

from tussle import Block, Mission, Simulation
from tussle.scene import Cuboid, Prism, Scene
from tussle.stock import AvoidWalls, RayTrace, SimpleCar, SimpleCarControllerHeading

IMAGE = Path(__file__).resolve().parents[2] / "docs" / "images" / "world.png"


def main() -> None:
    """Play three cars among walls, and draw their paths and one scan from above."""
    room = [
        Cuboid((x, y, 5), size)
        for x, y, size in (
            (60, 0, (2, 122, 10)),
            (-60, 0, (2, 122, 10)),
            (0, 60, (122, 2, 10)),
            (0, -60, (122, 2, 10)),
        )
    ]
    inner = [
        Cuboid((-25, 25, 5), (24, 10, 10), (0, 0, 0.5)),
        Prism(((20, -35), (42, -35), (42, -12), (34, -12), (34, -27), (20, -27)), high=10),
    ]
    lidar = RayTrace(
        num_rays_horiz=91,
        angle_res_horiz="2.6 deg",
        max_range=40.0,
        max_sample_rate=0.0,
        range_noise=0.1,
        dropout=0.01,
    )
    cars = Block(
        name="car", count=3, position=(0, 0, 1), heading="40 deg", heading_variance=4.0, sensor=lidar,
        autonomy=AvoidWalls(initial_speed=15.0),
        controller=SimpleCarControllerHeading(p_gain=1.5), motion=SimpleCar(),
    )  # fmt: skip
    simulation = Simulation(
        Mission(blocks=[cars], end=60, dt=0.05, scene=Scene(walls=[*room, *inner])), seeds=[4]
    )
    path = [simulation.read("car.pos")[0][0]]
    while not simulation.is_over:
        simulation.step()
        path.append(simulation.read("car.pos")[0][0])
    figure, axes = plt.subplots(figsize=(6.4, 6.0), layout="constrained")
    for wall in room + inner:
        axes.add_collection(PolyCollection(wall.triangles()[:, :, :2], facecolor="0.55", edgecolor="0.55"))
    axes.plot(*np.moveaxis(np.array(path)[:, :, :2], -1, 0), linewidth=1.0)
    pos, yaw = path[-1][0], simulation.read("car.yaw")[0][0, 0]
    x, y, _, _, in_range = simulation.read("car.RayTrace.points")[0][0, 0]
    east, north = pos[0] + x * np.cos(yaw) - y * np.sin(yaw), pos[1] + x * np.sin(yaw) + y * np.cos(yaw)
    hit = in_range > 0
    axes.plot(
        [np.full(hit.sum(), pos[0]), east[hit]],
        [np.full(hit.sum(), pos[1]), north[hit]],
        color="tab:red",
        linewidth=0.3,
    )
    axes.plot(east[hit], north[hit], ".", color="tab:red", markersize=3)
    axes.plot(path[-1][:, 0], path[-1][:, 1], "ko", markersize=5)
    axes.set(aspect="equal", xlabel="East [m]", ylabel="North [m]")
    figure.savefig(IMAGE, dpi=110)


if __name__ == "__main__":
    main()
