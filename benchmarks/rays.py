"""Rays per second of lidars among hills and moving boxes.

    python benchmarks/rays.py [--sizes 500] [--repeats 3] [--json FILE]

A mesh of 79,202 triangles on 400 m x 400 m; 500 boxes of 1 m that move; 500 robots (--sizes), each with a scan of 1,081 rays over 270
degrees and 100 m, on one thread. `cast` is the query alone, with the tree of the boxes built anew; `static` without the boxes;
`shuffled` with the rays in random order; `field` with the same hills as a height field; `sensor` is a step of RayTrace. `tree` is the
time to build the tree of the mesh."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import Any

import measuring
import numpy as np

from tussle import Block, Mission, Simulation
from tussle.api import Autonomy, Output
from tussle.scene import HeightField, Scene, TriangleMesh
from tussle.stock import RayTrace, SingleIntegrator

N = 200
SIZE = 400.0
RANGE = 100.0
RAYS = 1081


class Wander(Autonomy):
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    def step(self, g: Any) -> None:
        self.velocity[:] = 3.0 * g.normal("way", 3)


def hills() -> tuple[HeightField, TriangleMesh]:
    x = np.linspace(0.0, SIZE, N)
    rough = np.random.default_rng(1).normal(size=(N, N)) * 0.3
    field = HeightField(8.0 * np.sin(x / 23.0) * np.cos(x[:, None] / 31.0) + rough, cell=float(x[1]))
    corner = (np.arange(N - 1)[:, None] * N + np.arange(N - 1)).ravel()
    faces = [np.stack([corner, corner + a, corner + b], axis=1) for a, b in ((1, N + 1), (N + 1, N))]
    vertices = np.stack([*(axis.ravel() for axis in np.meshgrid(x, x)), field.height.ravel()], axis=1)
    return field, TriangleMesh(vertices, np.concatenate(faces))


def game(scene: Scene, robots: int, rays: int, boxes: int) -> Simulation:
    place = {
        "position": (200.0, 200.0, 8.0),
        "half_width": (150.0, 150.0, 4.0),
        "placement": "uniform",
        "scatter_first": True,
    }
    common: dict[str, Any] = {
        "autonomy": Wander(),
        "motion": SingleIntegrator(),
        "heading_variance": 9.0,
        **place,
    }
    lidar = RayTrace(
        num_rays_horiz=rays,
        angle_res_horiz=f"{270.0 / max(rays - 1, 1)} deg",
        max_range=RANGE,
        scan_period=0.0,
    )
    blocks = [Block(name="robot", count=robots, sensor=lidar, radius=0.5, **common)]
    blocks += [Block(name="box", count=boxes, box=(1.0, 1.0, 1.0), **common)] if boxes else []
    return Simulation(Mission(blocks=blocks, scene=scene, end=1e6, dt=0.1), seeds=[1])


def seconds(call: Callable[[], Any], repeats: int) -> float:
    """Median of the CPU times of a call."""
    call()
    times = []
    for _ in range(repeats):
        start = time.process_time()
        call()
        times.append(time.process_time() - start)
    return float(np.median(times))


def rows(robots: int, rays: int, repeats: int) -> Iterator[dict[str, Any]]:
    field, mesh = hills()
    yield {
        "what": "tree",
        "ms": 1e3 * seconds(lambda: Scene(meshes=[mesh]).caster, repeats),
        "million_rays_per_s": "",
    }
    for what, scene, boxes in (
        ("cast", Scene(meshes=[mesh]), 500),
        ("static", Scene(meshes=[mesh]), 0),
        ("field", Scene(terrain=field), 500),
    ):
        sim = game(scene, robots, rays, boxes)
        sim.step()
        view, bodies = sim.state.world_view, sim.state.population.bodies
        angle = view.yaw[:robots, None] + np.radians(np.linspace(-135.0, 135.0, rays))
        way = np.stack([np.cos(angle), np.sin(angle), np.zeros(angle.shape)]).reshape(3, -1)
        row = np.repeat(np.arange(robots), rays)
        orders = {what: np.arange(len(row))} | (
            {"shuffled": np.random.default_rng(2).permutation(len(row))} if what == "cast" else {}
        )
        for name, order in orders.items():
            start, ways, own = view.pos[:, row[order]].copy(), way[:, order].copy(), row[order]

            def call(
                view: Any = view, bodies: Any = bodies, start: Any = start, ways: Any = ways, own: Any = own
            ) -> None:
                bodies.version += 1  # the boxes have moved
                view.cast(start, ways, RANGE, row=own)

            yield measured(name, seconds(call, repeats), len(row))
        if what == "cast":
            yield measured("sensor", seconds(sim.step, repeats), len(row))


def measured(what: str, duration: float, n: int) -> dict[str, Any]:
    return {"what": what, "ms": 1e3 * duration, "million_rays_per_s": n / duration / 1e6}


def main() -> None:
    args = measuring.arguments(__doc__.splitlines()[0], (500,))
    found = [row for robots in args.sizes for row in rows(robots, RAYS, args.repeats)]
    measuring.report("Rays, one thread", found, args.json)


if __name__ == "__main__":
    main()
