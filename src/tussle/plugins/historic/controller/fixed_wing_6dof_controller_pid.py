"""FixedWing6DOFControllerPID as in SCRIMMAGE."""

from __future__ import annotations

import numpy as np

from tussle.api import GroupView
from tussle.plugins.stock.controller import fixed_wing_6dof_controller_pid

RUDDER, AILERON, PULSE = 0.26, 0.5, 0.4
RUDDER_FROM, AILERON_FROM = 2.0, 8.0


class FixedWing6DOFControllerPID(fixed_wing_6dof_controller_pid.FixedWing6DOFControllerPID):
    """FixedWing6DOFControllerPID that moves the rudder from 2 s to 2.8 s and the aileron from 8 s to 8.8 s, and nothing else.

    In SCRIMMAGE it is a stub. In tussle it holds heading, altitude and speed.
    """

    grade = "machine"

    def step(self, g: GroupView) -> None:
        """Move rudder and aileron."""
        self.throttle[:] = self.elevator[:] = 0.0
        self.rudder[:] = RUDDER * _doublet(g.t, RUDDER_FROM)
        self.aileron[:] = AILERON * _doublet(g.t, AILERON_FROM)


def _doublet(t: np.ndarray, begin: float) -> np.ndarray:
    """-1 for 0.4 s from `begin` on, then 1 for 0.4 s; else 0."""
    is_down, is_up = (t >= begin) & (t <= begin + PULSE), (t > begin + PULSE) & (t <= begin + 2.0 * PULSE)
    return np.where(is_down, -1.0, np.where(is_up, 1.0, 0.0))
