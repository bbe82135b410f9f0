"""Draws the entities: one batch of equal meshes for each model, whoever they belong to."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from tussle.view.frame import Frame
from tussle.view.looks import Looks
from tussle.view.page.display import Display
from tussle.view.page.failures import Safe
from tussle.view.shapes import MODELS

Clicked = Callable[[int, int], None]
"""Called with the number of a client and the id of the entity that it has clicked."""


@dataclass
class _Batch:
    """All entities that are drawn with one model.

    Attributes:
        handle: Of their meshes; None before there were any.
        rows: Their rows in the frame.
        id: Their ids.
    """

    handle: Any = None
    rows: np.ndarray | None = None
    id: np.ndarray | None = None


class Stage:
    """The entities of a game in the scene.

    Where each is goes out with each frame; who is there, with colours and sizes, only when somebody has come or gone. A message
    replaces the one before that has not been sent yet, so who sees slowly sees fewer frames and never old ones.

    Args:
        scene: The server's scene.
        blocks: Number of blocks.
        looks: Colours and models.
        display: What is shown.
        on_click: Told which entity is clicked.
        safe: Makes callbacks whose errors are told.
    """

    def __init__(
        self, scene: Any, blocks: int, looks: Looks, display: Display, on_click: Clicked, safe: Safe
    ) -> None:
        self._scene, self._display, self._on_click, self._safe = scene, display, on_click, safe
        self._names = sorted({looks.model(b) for b in range(blocks)} or {"sphere"})
        self._model = np.array([self._names.index(looks.model(b)) for b in range(blocks)], np.intp)
        self._colours = np.array([looks.block_colour(b) for b in range(blocks)], np.uint8).reshape(-1, 3)
        self._scales = np.array([looks.scale(b) for b in range(blocks)], np.float32)
        self._batches = [_Batch() for _ in self._names]
        self._seen: Frame | None = None
        self._version = -1

    def show(self, frame: Frame) -> None:
        """Draw a moment."""
        is_new = self._version != self._display.version or not _same(self._seen, frame)
        if is_new:
            model = self._model[frame.block]
            for number, batch in enumerate(self._batches):
                batch.rows = np.flatnonzero(model == number)
                batch.id = frame.id[batch.rows]
        self._seen, self._version = frame, self._display.version
        for name, batch in zip(self._names, self._batches, strict=True):
            assert batch.rows is not None
            if len(batch.rows):
                self._draw(name, batch, frame, is_new)
            elif batch.handle is not None:
                batch.handle.visible = False

    def _draw(self, name: str, batch: _Batch, frame: Frame, is_new: bool) -> None:
        pos = frame.pos[batch.rows].astype(np.float32)
        quat = frame.quat[batch.rows].astype(np.float32)
        if batch.handle is None:
            batch.handle = self._make(name, batch, pos, quat, frame.block[batch.rows])
            return
        handle = batch.handle
        if is_new:
            block = frame.block[batch.rows]
            handle.batched_colors = self._colours[block]
            handle.batched_scales = self._sizes(block)
            handle.wireframe = self._display.is_wireframe
            handle.visible = True
        handle.batched_positions = pos
        handle.batched_wxyzs = quat

    def _sizes(self, block: np.ndarray) -> np.ndarray:
        return np.asarray(self._display.size * self._scales[block], np.float32)

    def _make(self, name: str, batch: _Batch, pos: np.ndarray, quat: np.ndarray, block: np.ndarray) -> Any:
        mesh = MODELS[name].faceted()
        handle = self._scene.add_batched_meshes_simple(
            f"/entities/{name}", mesh.vertices, mesh.faces, batched_wxyzs=quat, batched_positions=pos,
            batched_colors=self._colours[block], batched_scales=self._sizes(block), lod="off", side="double",
            wireframe=self._display.is_wireframe, cast_shadow=False, receive_shadow=False,
        )  # fmt: skip

        def told_handle(event: Any) -> None:
            who, index = batch.id, event.instance_index
            if who is not None and index is not None and index < len(who):
                self._on_click(event.client_id, int(who[index]))

        handle.on_click(self._safe(told_handle))

        return handle


def _same(before: Frame | None, now: Frame) -> bool:
    """Whether the same entities are there, in the same order, of the same blocks."""
    if before is None:
        return False
    return before.id is now.id or (
        np.array_equal(before.id, now.id) and np.array_equal(before.block, now.block)
    )
