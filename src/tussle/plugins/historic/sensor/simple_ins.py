"""SimpleINS as in SCRIMMAGE."""

from __future__ import annotations

import numpy as np

from tussle.api import GroupView, Subscribe
from tussle.declare.messages import GPSStatus
from tussle.plugins.stock.sensor import simple_ins

ASSUMED_DT = 0.01  # [s]


class SimpleINS(simple_ins.SimpleINS):
    """SimpleINS whose error grows by the noise of a second in each step, and that uses the GPS of every entity.

    The acceleration is the change of the velocity over 0.01 s, whatever the step. The variance grows by the absolute value of another
    draw of the noise.
    """

    status = Subscribe(GPSStatus, network="GlobalNetwork")

    def _drift(self, g: GroupView) -> None:
        accel = np.minimum(1.0, np.abs(g.vel - self.last_vel) / ASSUMED_DT)
        mean, sd = np.stack([self.pos_noise_0, self.pos_noise_1, self.pos_noise_2], axis=1)
        self.error[:] += accel * (mean + sd * g.normal("pos", 3))
        self.variance[:] += np.abs(mean + sd * g.normal("variance", 3))[:2]
