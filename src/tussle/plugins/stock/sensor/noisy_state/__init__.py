"""A sensor that measures an entity's own state with Gaussian noise."""

from __future__ import annotations

import numpy as np

from tussle.api import GroupView, Output, Param, Sensor, service
from tussle.plugins.stock.sensor.noisy_state import kernels

PAIR = "mean sd"


class NoisyState(Sensor):
    """Measures the entity's own position, velocity and attitude: the true state plus normal noise, drawn at each call.

    The attitude noise is a rotation about the body's x, then y, then z axis. The measured state is the entity's
    belief. Its autonomies and controllers read the belief; motion models, other entities, interactions and metrics
    read the true state. Before the first call the belief is the initial state; between calls it does not change.

    Differences from SCRIMMAGE: draws are counter-based, so other entities and plugins do not affect them,
    and in the first step the belief has the heading and speed that the motion model starts from.
    """

    grade = "portable"

    pos_noise_0 = Param((0.0, 5.0), fields=PAIR, unit="m", doc="Error of x: mean and standard deviation.")
    pos_noise_1 = Param((0.0, 5.0), fields=PAIR, unit="m", doc="Error of y.")
    pos_noise_2 = Param((0.0, 1.0), fields=PAIR, unit="m", doc="Error of z.")
    vel_noise_0 = Param((0.0, 5.0), fields=PAIR, unit="m/s", doc="Error of the velocity's x.")
    vel_noise_1 = Param((0.0, 5.0), fields=PAIR, unit="m/s", doc="Error of the velocity's y.")
    vel_noise_2 = Param((0.0, 1.0), fields=PAIR, unit="m/s", doc="Error of the velocity's z.")
    orient_noise_0 = Param((0.0, 0.0), fields=PAIR, unit="rad", doc="Rotation error about the body x axis.")
    orient_noise_1 = Param((0.0, 0.0), fields=PAIR, unit="rad", doc="Rotation error about the body y axis.")
    orient_noise_2 = Param((0.0, 0.0), fields=PAIR, unit="rad", doc="Rotation error about the body z axis.")
    belief_pos = Output(
        "belief_pos_x belief_pos_y belief_pos_z", unit="m", doc="Believed position, world frame."
    )
    belief_vel = Output(
        "belief_vel_x belief_vel_y belief_vel_z", unit="m/s", doc="Believed velocity, world frame."
    )
    belief_quat = Output(
        "belief_quat_w belief_quat_x belief_quat_y belief_quat_z", doc="Believed attitude, body to world."
    )

    @service
    def velocity_noise(self, g: GroupView) -> np.ndarray:
        """Return the standard deviations of the errors of the velocity [m/s], (3, n), world frame, for plugins that pass it on."""
        return np.stack([self.vel_noise_0[1], self.vel_noise_1[1], self.vel_noise_2[1]])

    def step(self, g: GroupView) -> None:
        """Update the belief of all rows."""
        kernels.blur(
            (*g.components("pos"), *g.components("vel"), *g.components("quat")), (self.pos_noise_0, self.pos_noise_1, self.pos_noise_2),
            (self.vel_noise_0, self.vel_noise_1, self.vel_noise_2), (self.orient_noise_0, self.orient_noise_1, self.orient_noise_2),
            (g.normal("pos", 3), g.normal("vel", 3), g.normal("orient", 3)), self.belief_pos, self.belief_vel, self.belief_quat,
        )  # fmt: skip
