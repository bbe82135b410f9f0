"""A point that follows a velocity command."""

from __future__ import annotations

import numpy as np

from tussle.api import Input, MotionBody, MotionModel, Param, State
from tussle.plugins.stock.motion.single_integrator import kernels


class SingleIntegrator(MotionModel):
    """A point that moves at the commanded velocity and faces its direction of motion.

    x' = v. A constant velocity is integrated exactly, for any number of substeps. A command longer than `max_speed` is
    shortened to it; in SCRIMMAGE every nonzero command was scaled to max_speed, a shorter one too.

    In a climb the nose is up. At rest the attitude does not change, and in vertical motion the heading does not change.
    In SCRIMMAGE a climb lowered the nose, and at rest the heading was East. Some of its missions set `vel_max`,
    which its model did not read.
    """

    grade = "portable"
    only_calls_kernels = True

    max_speed = Param(-1.0, unit="m/s", doc="Largest speed; negative for no limit.")
    override_heading = Param(
        False,
        structural=True,
        doc="Take the heading from desired_heading instead of the direction of motion.",
    )
    x = State(
        "x y z vx vy vz yaw climb",
        unit="m m m m/s m/s m/s rad rad",
        doc="Position, velocity, heading, elevation (nose up), world frame.",
    )
    velocity = Input("velocity_x velocity_y velocity_z", unit="m/s", doc="Commanded velocity, world frame.")
    desired_heading = Input(unit="rad", doc="Heading, with override_heading.")

    advance = kernels.advance

    def active_inputs(self) -> list[str]:
        """Return velocity, and desired_heading with override_heading."""
        return ["velocity", "desired_heading"] if self.override_heading else ["velocity"]

    def from_body(self, body: MotionBody, rows: np.ndarray) -> None:
        """Copy position, velocity, heading and elevation."""
        self.x[:3, rows] = body.pos[:, rows]
        self.x[3:6, rows] = body.vel[:, rows]
        self.x[6, rows] = body.column("yaw", rows)
        self.x[7, rows] = body.column("climb", rows)

    def to_body(self, body: MotionBody) -> None:
        """Write position, attitude and velocity."""
        kernels.to_body(self.x, body.table, body.first)
