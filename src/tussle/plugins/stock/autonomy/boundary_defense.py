"""Defence of a region."""

from __future__ import annotations

import numpy as np

from tussle.api import Autonomy, GroupView, Output, Param, unit


class BoundaryDefense(Autonomy):
    """Flies to the nearest entity inside a boundary that is not of the boundary's team; without one, to the centre.

    It aims at the position of the intruder one step ahead. The desired speed is the distance to that point, divided by 1 s, plus the speed
    of the intruder; limit it with `SingleIntegrator.max_speed`. In SCRIMMAGE the speed of the intruder was not added, and a defender
    learned of its boundary by a message at the end of the first step, and stood still until then.

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
        vel = np.where(other >= 0, bodies.vel[:, other], 0.0)
        ahead = bodies.pos[:, other] + g.dt * vel
        way = np.where(other >= 0, ahead, np.array(region.center)[:, None]) - g.pos
        self.velocity[:] = self.command(way, vel)

    def command(self, way: np.ndarray, vel: np.ndarray) -> np.ndarray:
        """Desired velocity [m/s], (3, n), for the way to a point [m] and the intruder's velocity [m/s], 0 without one, (3, n) each."""
        speed = np.sqrt(vel[0] * vel[0] + vel[1] * vel[1] + vel[2] * vel[2])
        return np.asarray(way + speed * unit(way))
