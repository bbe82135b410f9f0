"""RandomAttrit as in SCRIMMAGE."""

from __future__ import annotations

import numpy as np

from tussle.api import WorldView
from tussle.plugins.stock.interaction import random_attrit


class RandomAttrit(random_attrit.RandomAttrit):
    """RandomAttrit that removes at most one entity per step, by the time at the start of the step.

    SCRIMMAGE's own generator has no seed, so all runs lose the same entities there; here the draws are keyed as in tussle.
    """

    most_per_step = 1

    def _elapsed(self, w: WorldView) -> np.ndarray:
        return super()._elapsed(w) - w.dt
