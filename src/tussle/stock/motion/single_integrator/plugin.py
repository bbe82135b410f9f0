"""The single integrator: velocity in, position out."""

from __future__ import annotations

import numpy as np

from tussle.api import Input, MotionBody, MotionModel, Param, State
from tussle.stock.motion.single_integrator import kernels


class SingleIntegrator(MotionModel):
    """A point that takes the commanded velocity at once and looks where it goes.

    x' = v. A velocity held over a step is integrated exactly, whatever the number of substeps. With `max_speed` >= 0
    every command but zero runs at max_speed, as in the existing system.

    The nose rises when the point climbs, and attitude stays when it stops (the heading also while it moves straight
    up or down). In the existing system a climb put the nose down, and the heading snapped East at rest. `vel_max`,
    which some of its missions set for this model, never was a parameter of it.
    """

    grade = "portable"

    max_speed = Param(
        -1.0, unit="m/s", doc="Speed of every command that is not zero; negative: as commanded."
    )
    override_heading = Param(
        False, structural=True, doc="Take the heading from desired_heading instead of the course."
    )
    x = State(
        "x y z vx vy vz yaw climb",
        unit="m m m m/s m/s m/s rad rad",
        doc="Position, velocity, heading, elevation (nose up), world frame.",
    )
    velocity = Input("velocity_x velocity_y velocity_z", unit="m/s", doc="Wanted velocity, world frame.")
    desired_heading = Input(unit="rad", doc="Heading, with override_heading.")

    advance = kernels.advance

    def active_inputs(self) -> list[str]:
        """desired_heading counts with override_heading only."""
        return ["velocity", "desired_heading"] if self.override_heading else ["velocity"]

    def from_body(self, body: MotionBody, rows: np.ndarray) -> None:
        """Take position, velocity, heading and elevation over."""
        self.x[:3, rows] = body.pos[:, rows]
        self.x[3:6, rows] = body.vel[:, rows]
        self.x[6, rows] = body.yaw[rows]
        self.x[7, rows] = body.climb[rows]

    def to_body(self, body: MotionBody) -> None:
        """Publish position, attitude and velocity."""
        kernels.to_body(self.x, body.table, body.first)
