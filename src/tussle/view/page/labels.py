"""Names the entities in the scene."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from tussle.view.frame import Frame
from tussle.view.page.display import Display

MOST_LABELS = 60
"""Each label is a message of its own in each frame, and more than these hide what they name."""


class Labels:
    """Names beside the entities; of many, beside those with the lowest ids and those that somebody looks at.

    Args:
        scene: The server's scene.
        display: What is shown.
        name: What to call the entity in a row of a frame.
    """

    def __init__(self, scene: Any, display: Display, name: Callable[[Frame, int], str]) -> None:
        self._scene, self._display, self._name = scene, display, name
        self._handles: dict[int, Any] = {}

    def show(self, frame: Frame, watched: Iterable[int]) -> None:
        """Draw the names at a moment.

        Args:
            frame: The moment.
            watched: Ids that are named in any case.
        """
        rows = {who: row for who in watched if (row := frame.row_of(who)) >= 0}
        if self._display.has_labels:
            for row in range(min(len(frame), MOST_LABELS)):
                rows.setdefault(int(frame.id[row]), row)
        for who in [who for who in self._handles if who not in rows]:
            self._handles.pop(who).remove()
        above = 0.6 * self._display.size
        for who, row in rows.items():
            east, north, up = (float(c) for c in frame.pos[row])
            position = (east, north, up + above)
            handle = self._handles.get(who)
            if handle is None:
                self._handles[who] = self._scene.add_label(
                    f"/labels/{who}", self._name(frame, row), position=position, anchor="bottom-center",
                    font_screen_scale=0.8 * self._display.label_scale,
                )  # fmt: skip
            else:
                handle.position = position
                handle.font_screen_scale = 0.8 * self._display.label_scale
