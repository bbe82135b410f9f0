"""FlagCaptureInteraction as in SCRIMMAGE."""

from __future__ import annotations

import numpy as np

from tussle.api import WorldView
from tussle.plugins.stock.interaction import flag_capture_interaction
from tussle.world.scene import Volume


class FlagCaptureInteraction(flag_capture_interaction.FlagCaptureInteraction):
    """FlagCaptureInteraction in which all that enter in one step publish that they took the flag, and the last one has it.

    The last is that of the largest id; in tussle the nearest to the centre takes it. The boundaries are known from the end of the first
    step on. Only those that are inside at the end of a step enter.
    """

    def _enters(self, w: WorldView, shape: Volume, may: np.ndarray) -> np.ndarray:
        return np.asarray(may & shape.contains(w.pos))

    def _takers(self, w: WorldView, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        rows = rows[w.step_count[w.world[rows]] > 0]
        rows = rows[np.lexsort((w.id[rows], w.world[rows]))]
        _, last = np.unique(w.world[rows][::-1], return_index=True)
        return rows[::-1][last], rows
