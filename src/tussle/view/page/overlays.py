"""Draws on demand how far entities reach: rings, cones, and links between those in reach."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from tussle.view.frame import Frame
from tussle.view.looks import Looks
from tussle.view.page.colours import LINK
from tussle.view.page.display import Display
from tussle.view.shapes import Mesh

MOST_LINKS = 5_000
"""Lines between entities; of more, the shortest are drawn."""
N_SIDES = 48
"""Corners of a ring or of a cone's rim."""


def ring(width: float = 0.03) -> Mesh:
    """A flat ring of radius 1 m around the z axis."""
    angle = 2.0 * np.pi * np.arange(N_SIDES) / N_SIDES
    circle = np.stack([np.cos(angle), np.sin(angle), np.zeros(N_SIDES)], 1)
    i = np.arange(N_SIDES)
    j = (i + 1) % N_SIDES
    faces = np.concatenate([np.stack([i, i + N_SIDES, j + N_SIDES], 1), np.stack([i, j + N_SIDES, j], 1)])
    return Mesh(np.concatenate([(1.0 - width) * circle, circle]), faces)


def cone(angle: float) -> Mesh:
    """What lies within 1 m of the origin and half an angle [rad] off the x axis: its skin, with the round end."""
    half = 0.5 * min(angle, 2.0 * np.pi)
    turn = 2.0 * np.pi * np.arange(N_SIDES) / N_SIDES
    tilts = np.linspace(half, 0.0, max(2, int(np.ceil(half / 0.2)) + 1))[:-1]
    rings = [
        np.stack([np.full(N_SIDES, np.cos(a)), np.sin(a) * np.cos(turn), np.sin(a) * np.sin(turn)], 1)
        for a in tilts
    ]
    vertices = np.concatenate([np.zeros((1, 3)), *rings, [[1.0, 0.0, 0.0]]])
    i = np.arange(N_SIDES)
    j = (i + 1) % N_SIDES
    faces = [np.stack([np.zeros(N_SIDES, int), 1 + j, 1 + i], 1)]
    for k in range(len(tilts) - 1):
        a, b = 1 + k * N_SIDES, 1 + (k + 1) * N_SIDES
        faces += [np.stack([a + i, a + j, b + j], 1), np.stack([a + i, b + j, b + i], 1)]
    last, tip = 1 + (len(tilts) - 1) * N_SIDES, len(vertices) - 1
    faces.append(np.stack([last + i, last + j, np.full(N_SIDES, tip)], 1))
    return Mesh(vertices, np.concatenate(faces))


def links(pos: np.ndarray, reach: float) -> np.ndarray:
    """Pairs of rows of positions [m], (n, 3), that are not further apart than `reach` [m], (k, 2): at most `MOST_LINKS`."""
    if len(pos) < 2:
        return np.zeros((0, 2), np.intp)
    tree = cKDTree(pos)
    if tree.count_neighbors(tree, reach) > 40 * MOST_LINKS:
        # Too many to be counted one by one: each entity's nearest stand for all.
        distance, other = tree.query(pos, k=min(len(pos), 4), distance_upper_bound=reach)
        one = np.repeat(np.arange(len(pos)), other.shape[1]).reshape(other.shape)
        found = np.stack([one, other], -1)[np.isfinite(distance) & (one != other)]
        pairs = np.unique(np.sort(found, axis=1), axis=0)
    else:
        pairs = tree.query_pairs(reach, output_type="ndarray")
    if len(pairs) > MOST_LINKS:
        length = np.linalg.norm(pos[pairs[:, 0]] - pos[pairs[:, 1]], axis=1)
        pairs = pairs[np.argpartition(length, MOST_LINKS)[:MOST_LINKS]]
    return np.asarray(pairs)


class Overlays:
    """Rings, cones and links around the entities.

    Args:
        scene: The server's scene.
        looks: Colours.
        blocks: Number of blocks.
        display: What is shown.
    """

    def __init__(self, scene: Any, looks: Looks, blocks: int, display: Display) -> None:
        self._scene, self._display = scene, display
        self._colours = np.array([looks.block_colour(b) for b in range(blocks)], np.uint8).reshape(-1, 3)
        self._rings: Any = None
        self._cones: Any = None
        self._angle = -1.0
        self._links: Any = None

    def show(self, frame: Frame) -> None:
        """Draw what is asked for, at a moment."""
        display, n = self._display, len(frame)
        level = np.tile(np.array([1.0, 0.0, 0.0, 0.0], np.float32), (n, 1))
        if display.has_rings and n:
            self._rings = self._batch(self._rings, "/rings", ring(), frame, level, display.ring_radius, 0.8)
        elif self._rings is not None:
            self._rings.visible = False
        if self._angle != display.cone_angle and self._cones is not None:
            self._cones.remove()
            self._cones = None
        if display.has_cones and n:
            self._angle = display.cone_angle
            quat = frame.quat.astype(np.float32)
            self._cones = self._batch(
                self._cones, "/cones", cone(display.cone_angle), frame, quat, display.cone_range, 0.12
            )
        elif self._cones is not None:
            self._cones.visible = False

    def _batch(
        self, handle: Any, name: str, mesh: Mesh, frame: Frame, quat: np.ndarray, size: float, opacity: float
    ) -> Any:
        pos, colours = frame.pos.astype(np.float32), self._colours[frame.block]
        scales = np.full(len(frame), size, np.float32)
        if handle is None:
            return self._scene.add_batched_meshes_simple(
                name, mesh.vertices, mesh.faces, batched_wxyzs=quat, batched_positions=pos, batched_scales=scales,
                batched_colors=colours, opacity=opacity, side="double", lod="off", cast_shadow=False, receive_shadow=False,
            )  # fmt: skip
        handle.batched_colors, handle.batched_scales = colours, scales
        handle.batched_positions, handle.batched_wxyzs = pos, quat
        handle.visible = True
        return handle

    def show_links(self, frame: Frame) -> None:
        """Draw a line between any two entities in reach of each other."""
        pairs = (
            links(frame.pos, self._display.link_range) if self._display.has_links else np.zeros((0, 2), int)
        )
        if not len(pairs):
            if self._links is not None:
                self._links.visible = False
            return
        points = frame.pos[pairs].astype(np.float32)
        if self._links is None:
            self._links = self._scene.add_line_segments(
                "/links", points, LINK, thickness=1.0, thickness_units="screen"
            )
        else:
            self._links.points = points
            self._links.visible = True
