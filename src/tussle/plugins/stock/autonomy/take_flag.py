"""An autonomy that fetches a flag."""

from __future__ import annotations

import numpy as np

from tussle.api import Autonomy, GroupView, Output, Param, State, Subscribe
from tussle.declare.messages import FlagTaken


class TakeFlag(Autonomy):
    """Flies to a flag until it has taken it, then to the region to which the flag must be brought.

    The desired velocity is the offset to the centre of the region, divided by 1 s; limit it with `SingleIntegrator.max_speed`. In
    SCRIMMAGE an entity learned of the regions by a message at the end of the first step, and stood still until then.

    Raises:
        MissionError: An id is not that of exactly one boundary of the mission.
    """

    grade = "portable"

    flag_boundary_id = Param(1, structural=True, doc="Boundary of the flag.")
    capture_boundary_id = Param(2, structural=True, doc="Boundary to which the flag is brought.")
    has_flag = State(dtype=bool, doc="Whether the entity took the flag.")
    taken = Subscribe(FlagTaken)
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s", doc="Desired velocity, world frame.")

    def named_regions(self) -> tuple[int, ...]:
        """Return both boundaries."""
        return self.values["flag_boundary_id"], self.values["capture_boundary_id"]

    def step(self, g: GroupView) -> None:
        if self.taken:
            rows, messages = self.taken.pairs()
            is_mine = (messages.entity == g.id[rows]) & (messages.boundary == self.flag_boundary_id)
            self.has_flag[rows[is_mine]] = True
        flag, home = (
            np.array(g.region(i).center)[:, None] for i in (self.flag_boundary_id, self.capture_boundary_id)
        )
        self.velocity[:] = np.where(self.has_flag, home, flag) - g.pos
