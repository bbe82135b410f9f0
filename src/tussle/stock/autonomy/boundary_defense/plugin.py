"""Defence of a region."""

from __future__ import annotations

from typing import Any

import numpy as np

from tussle.api import Autonomy, GroupView, Output, Param


class BoundaryDefense(Autonomy):
    """Flies to the nearest entity inside a boundary that is not of the boundary's team; without one, to the centre.

    The desired velocity is the one with which it is there in 1 s; limit it with `SingleIntegrator.max_speed`. In SCRIMMAGE a
    defender aimed at the intruder's position one step ahead, always at max_speed; it learned of its boundary by a message at
    the end of the first step, and stood still until then.

    Raises:
        MissionError: `boundary_id` is not the id of exactly one boundary of the mission.
    """

    grade = "portable"

    boundary_id = Param(1, structural=True, doc="Boundary that is defended.")
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s", doc="Desired velocity, world frame.")

    def named_regions(self) -> tuple[int, ...]:
        """Return the defended boundary."""
        return (self.values["boundary_id"],)

    def step(self, g: GroupView) -> None:
        region, bodies = g.region(self.boundary_id), g.bodies
        intrudes = (bodies.team != region.team) & region.shape.contains(bodies.pos)
        other = g.nearest(among=intrudes).other[0]
        ahead = bodies.pos[:, other] + self.lead(g) * bodies.vel[:, other]
        self.velocity[:] = np.where(other >= 0, ahead, np.array(region.center)[:, None]) - g.pos

    def lead(self, g: GroupView) -> Any:
        """Time [s] by which the point that is flown to is ahead of the intruder; a number or (n,)."""
        return 1.0
