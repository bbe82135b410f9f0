"""A sensor that measures other entities with Gaussian noise."""

from __future__ import annotations

import math

import numpy as np

from tussle.api import GroupView, HistoricAttributes, Output, Param, Sensor, neighbors
from tussle.plugins.stock.sensor.noisy_contacts import kernels

PAIR = "mean sd"
FIELDS = "id team x y z vx vy vz qw qx qy qz"


class NoisyContacts(Sensor):
    """Measures the state of every other entity within range, with normal noise.

    The noise is drawn for each pair at each call. Draws are keyed by the measuring entity and the id of the measured
    one, so adding entities does not change other measurements; SCRIMMAGE drew them in the order of a hash
    table. SCRIMMAGE also published a covariance, a constant 5 on the diagonal whatever the noise. It is
    left out here, because the standard deviations are parameters. `max_range` is new. By default the range is
    infinite, and the total length of the lists grows with the square of the number of entities.
    """

    grade = "portable"
    historic_attributes = HistoricAttributes(unread=("topic_name",))

    max_range = Param(math.inf, unit="m", ge=0.0, doc="Entities further away are not measured.")
    pos_noise_0 = Param((0.0, 5.0), fields=PAIR, unit="m", doc="Error of x: mean and standard deviation.")
    pos_noise_1 = Param((0.0, 5.0), fields=PAIR, unit="m", doc="Error of y.")
    pos_noise_2 = Param((0.0, 1.0), fields=PAIR, unit="m", doc="Error of z.")
    vel_noise_0 = Param((0.0, 5.0), fields=PAIR, unit="m/s", doc="Error of the velocity's x.")
    vel_noise_1 = Param((0.0, 5.0), fields=PAIR, unit="m/s", doc="Error of the velocity's y.")
    vel_noise_2 = Param((0.0, 1.0), fields=PAIR, unit="m/s", doc="Error of the velocity's z.")
    orient_noise_0 = Param(
        (0.0, 0.0), fields=PAIR, unit="rad", doc="Rotation error about the contact's x axis."
    )
    orient_noise_1 = Param(
        (0.0, 0.0), fields=PAIR, unit="rad", doc="Rotation error about the contact's y axis."
    )
    orient_noise_2 = Param(
        (0.0, 0.0), fields=PAIR, unit="rad", doc="Rotation error about the contact's z axis."
    )
    contacts = Output(
        ragged=True,
        fields=FIELDS,
        unit="1 1 m m m m/s m/s m/s 1 1 1 1",
        doc="Measured states, world frame.",
    )
    n_contacts = Output(doc="Number of entities measured.")

    @neighbors("max_range", **dict.fromkeys(FIELDS.split(), "each"))
    @staticmethod
    def contact(
        other_id: int, other_team: int, other_pos_x: float, other_pos_y: float, other_pos_z: float,
        other_vel_x: float, other_vel_y: float, other_vel_z: float,
        other_quat_w: float, other_quat_x: float, other_quat_y: float, other_quat_z: float,
    ) -> tuple[float, ...]:  # fmt: skip
        return (
            other_id, other_team, other_pos_x, other_pos_y, other_pos_z, other_vel_x, other_vel_y, other_vel_z,
            other_quat_w, other_quat_x, other_quat_y, other_quat_z,
        )  # fmt: skip

    def step(self, g: GroupView) -> None:
        """Measure the contacts of all rows."""
        near = self.contact(g)
        kernels.blur(
            near.row, (self.pos_noise_0, self.pos_noise_1, self.pos_noise_2), (self.vel_noise_0, self.vel_noise_1, self.vel_noise_2),
            (self.orient_noise_0, self.orient_noise_1, self.orient_noise_2),
            tuple([g.normal_pairs(label, near, 3) for label in ("pos", "vel", "orient")]), near.values,
        )  # fmt: skip
        start = np.searchsorted(near.row, np.arange(g.n + 1))
        self.contacts.set(start, near.values)
        self.n_contacts[:] = start[1:] - start[:-1]
