"""CPA as in SCRIMMAGE."""

from __future__ import annotations

import numpy as np

from tussle.api import WorldView
from tussle.plugins.stock.metric import cpa


class CPA(cpa.CPA):
    """CPA whose times are those of the start of the step, though the distances are those of its end."""

    def _now(self, w: WorldView) -> np.ndarray:
        return w.t - w.context.clock.dt
