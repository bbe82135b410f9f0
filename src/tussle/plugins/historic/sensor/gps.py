"""GPS as in SCRIMMAGE."""

from __future__ import annotations

import numpy as np

from tussle.api import GroupView, Publish
from tussle.declare.messages import GPSStatus
from tussle.plugins.stock.sensor import gps


class GPS(gps.GPS):
    """GPS that sends its measurements to all entities, uses only the last boundary, and measures without a fix too.

    The boundary is known from the end of the first step on. Ids without a boundary are ignored.
    """

    status = Publish(GPSStatus, network="GlobalNetwork")

    def named_regions(self) -> tuple[float, ...]:
        """Return none: an id without a boundary is no error."""
        return ()

    def step(self, g: GroupView) -> None:
        denied = super().named_regions()
        self.coordinates[:] = g.scene.origin.to_geodetic(g.pos)
        has_fix = np.ones(g.n, bool)
        if g.context.regions and g.context.regions[-1].boundary in denied:
            has_fix &= ~g.context.regions[-1].shape.contains(g.pos) | (g.step_count == 0)
        self.gps_fix[:], self.gps_time[:] = has_fix, g.t
        self.status.publish(np.arange(g.n), geodetic=self.coordinates, has_fix=has_fix, t=self.gps_time)
