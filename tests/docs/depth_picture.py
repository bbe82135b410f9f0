"""Makes the picture of a DepthCamera in docs/sensors.md: python tests/docs/depth_picture.py."""

from __future__ import annotations

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import ListedColormap

from tussle import Block, Mission, Simulation
from tussle.scene import Cuboid, FlatGround, HeightField, Prism, Scene
from tussle.stock import DepthCamera, Still
from tussle.world.rays.solids import KINDS

IMAGE = Path(__file__).resolve().parents[2] / "docs" / "images" / "depth-camera.png"
COLORS = ("white", "yellowgreen", "slategray", "peru", "crimson")


def main() -> None:
    """Draw depth and segmentation of one camera in a street."""
    scene = Scene(
        ground=FlatGround(0.0),
        terrain=HeightField.generate((120.0, 120.0), cell=3.0, z_std=1.0, seed=4),
        walls=[
            Prism([(15, -14), (40, -14), (40, -6), (15, -6)], high=11),
            Prism([(20, 7), (45, 7), (45, 16), (20, 16)], high=7),
            Cuboid((60, 0, 4), (1, 16, 8)),
        ],
    )
    camera = DepthCamera(img_width=96, img_height=64, elevation_fov="58 deg", max_range=80.0, xyz=(0, 0, 1.0))
    blocks = [
        Block(
            name="camera", position=(0, 0, 1.5), variance=(0, 0, 0), motion=Still(), sensor=camera, radius=0.5
        ),
        *(
            Block(
                name=f"car{x}",
                team=2,
                position=(x, y, 1.5),
                variance=(0, 0, 0),
                heading=0.4,
                box=(4.5, 2, 1.6),
                motion=Still(),
            )
            for x, y in ((12, 2.5), (24, -2.5), (38, 1))
        ),
        Block(name="drone", team=3, position=(18, -3, 5), variance=(0, 0, 0), radius=0.8, motion=Still()),
    ]
    simulation = Simulation(Mission(blocks=blocks, scene=scene, end=1))
    simulation.step()
    depth = simulation.read("camera.DepthCamera.depth")[0][0, 0].reshape(64, 96)
    kind = simulation.read("camera.DepthCamera.segmentation")[0][0, 0][0].reshape(64, 96)
    figure, (left, right) = plt.subplots(1, 2, figsize=(9.6, 3.5), layout="constrained")
    drawn = left.imshow(np.where(kind > 0, depth, np.nan), cmap="viridis_r")
    figure.colorbar(drawn, ax=left, label="Depth [m]")
    drawn = right.imshow(kind, cmap=ListedColormap(COLORS), vmin=-0.5, vmax=4.5)
    bar = figure.colorbar(drawn, ax=right, ticks=range(5))
    bar.ax.set_yticklabels(KINDS)
    for axes in (left, right):
        axes.set(xticks=[], yticks=[])
    figure.savefig(IMAGE, dpi=100)


if __name__ == "__main__":
    main()
