"""Shows in the scene what plugins have drawn."""

from __future__ import annotations

from typing import Any

import numpy as np

from tussle.view.drawn import Shape
from tussle.view.page.reading import Drawing, read_drawing
from tussle.view.shapes import Mesh, ball, box

MOST_TEXTS = 100
MOST_MESHES = 50
"""Each is a message of its own."""
N_SIDES = 24


def _cone_mesh() -> Mesh:
    """A cone with its tip at the origin, 1 m along x and 1 m in radius at its end."""
    angle = 2.0 * np.pi * np.arange(N_SIDES) / N_SIDES
    rim = np.stack([np.ones(N_SIDES), np.cos(angle), np.sin(angle)], 1)
    i = np.arange(N_SIDES)
    j = (i + 1) % N_SIDES
    skin = np.stack([np.full(N_SIDES, 0), 1 + j, 1 + i], 1)
    end = np.stack([1 + i, 1 + j, np.full(N_SIDES, N_SIDES + 1)], 1)
    return Mesh(np.concatenate([np.zeros((1, 3)), rim, [[1.0, 0.0, 0.0]]]), np.concatenate([skin, end]))


class Drawn:
    """What plugins have drawn in the last step, and before if it lasts. Alike shapes go into one node, so that many cost little.

    Args:
        scene: The server's scene.

    Attributes:
        notes: What could not be drawn, and why.
    """

    def __init__(self, scene: Any) -> None:
        self._scene = scene
        self._last: tuple[Shape, ...] = ()
        self._nodes: dict[str, Any] = {}
        self._counts: dict[str, int] = {}
        self.notes: list[str] = []

    def show(self, shapes: tuple[Shape, ...], size: float) -> None:
        """Draw shapes instead of those before.

        Args:
            shapes: What plugins have drawn.
            size: Of points without a size of their own [m].
        """
        if len(shapes) == len(self._last) and all(a is b for a, b in zip(shapes, self._last, strict=True)):
            return
        self._last = shapes
        drawing = read_drawing(shapes, size)
        self.notes += [note for note in drawing.notes if note not in self.notes]
        self._points(drawing)
        self._lines(drawing)
        self._arrows(drawing)
        for kind in ("sphere", "box", "cone"):
            self._solids(kind, drawing)
        self._texts(drawing)
        self._meshes(drawing)

    def _drop(self, name: str) -> None:
        node = self._nodes.pop(name, None)
        if node is not None:
            node.remove()

    def _points(self, drawing: Drawing) -> None:
        # A cloud has one size of points: those of each size are one.
        clouds: dict[float, list[tuple[np.ndarray, np.ndarray]]] = {}
        for pos, colour, sizes in drawing.points:
            for value in np.unique(sizes):
                clouds.setdefault(float(value), []).append((pos[sizes == value], colour[sizes == value]))
        wanted = {f"points {i}": item for i, item in enumerate(sorted(clouds.items(), key=lambda c: c[0]))}
        for name in [n for n in self._nodes if n.startswith("points ") and n not in wanted]:
            self._drop(name)
        for name, (size, parts) in wanted.items():
            pos = np.concatenate([p for p, _ in parts]).astype(np.float32)
            colour = np.concatenate([c for _, c in parts])
            node = self._nodes.get(name)
            if node is None:
                self._nodes[name] = self._scene.add_point_cloud(
                    f"/drawn/{name}", pos, colour, point_size=size, point_shape="circle", precision="float32",
                    point_shading="flat",
                )  # fmt: skip
            else:
                node.points, node.colors, node.point_size = pos, colour, size

    def _lines(self, drawing: Drawing) -> None:
        parts = [part for part in drawing.lines if len(part[0])]
        if not parts:
            self._drop("lines")
            return
        ends = np.concatenate([e for e, _ in parts]).astype(np.float32)
        colours = np.concatenate([c for _, c in parts])
        node = self._nodes.get("lines")
        if node is None:
            self._nodes["lines"] = self._scene.add_line_segments(
                "/drawn/lines", ends, colours, thickness=drawing.width, thickness_units="screen"
            )
        else:
            node.points, node.colors, node.thickness = ends, colours, drawing.width

    def _arrows(self, drawing: Drawing) -> None:
        parts = [part for part in drawing.arrows if len(part[0])]
        if not parts:
            self._drop("arrows")
            return
        ends = np.concatenate([e for e, _ in parts]).astype(np.float32)
        colours = np.concatenate([c for _, c in parts])
        # Arrows of one node are equally thick: a thirtieth of the usual length.
        usual = float(np.median(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1))) or 1.0
        node = self._nodes.get("arrows")
        if node is None or len(node.points) != len(ends):
            self._drop("arrows")
            self._nodes["arrows"] = self._scene.add_arrows(
                "/drawn/arrows",
                ends,
                colours,
                shaft_radius=usual / 60,
                head_radius=usual / 25,
                head_length=usual / 8,
            )
        else:
            node.points, node.colors = ends, colours

    def _solids(self, kind: str, drawing: Drawing) -> None:
        parts = drawing.solids.get(kind, [])
        if not parts:
            self._drop(kind)
            return
        pos, quat, scale, colour, opacity = (np.concatenate(p) for p in zip(*parts, strict=True))
        values = {
            "batched_positions": pos.astype(np.float32), "batched_wxyzs": quat.astype(np.float32),
            "batched_scales": scale.astype(np.float32), "batched_colors": colour,
        }  # fmt: skip
        node = self._nodes.get(kind)
        if node is not None and self._counts[kind] == len(pos):
            for name, value in values.items():
                setattr(node, name, value)
            node.batched_opacities = opacity.astype(np.float32)
            return
        self._drop(kind)
        mesh = {"sphere": ball(2), "box": box((-0.5,) * 3, (0.5,) * 3).faceted(), "cone": _cone_mesh()}[kind]
        self._counts[kind] = len(pos)
        self._nodes[kind] = self._scene.add_batched_meshes_simple(
            f"/drawn/{kind}", mesh.vertices, mesh.faces, **values, batched_opacities=opacity.astype(np.float32),
            lod="off", side="double", cast_shadow=False, receive_shadow=False,
        )  # fmt: skip

    def _texts(self, drawing: Drawing) -> None:
        texts = drawing.texts[:MOST_TEXTS]
        for i in range(len(texts), self._counts.get("text", 0)):
            self._drop(f"text {i}")
        self._counts["text"] = len(texts)
        for i, (text, pos) in enumerate(texts):
            node = self._nodes.get(f"text {i}")
            position = tuple(float(c) for c in pos)
            if node is None:
                self._nodes[f"text {i}"] = self._scene.add_label(
                    f"/drawn/text {i}", text, position=position, font_screen_scale=0.9, anchor="center-center"
                )
            else:
                node.text, node.position = text, position

    def _meshes(self, drawing: Drawing) -> None:
        meshes = drawing.meshes[:MOST_MESHES]
        for i in range(self._counts.get("mesh", 0)):
            self._drop(f"mesh {i}")
        self._counts["mesh"] = len(meshes)
        for i, (vertices, faces, pos, quat, colour, opacity) in enumerate(meshes):
            self._nodes[f"mesh {i}"] = self._scene.add_mesh_simple(
                f"/drawn/mesh {i}", vertices, faces, color=tuple(int(c) for c in colour), side="double", flat_shading=True,
                opacity=None if opacity >= 1.0 else opacity, position=tuple(pos), wxyz=tuple(quat), cast_shadow=False,
            )  # fmt: skip
