"""Gaussian noise on what an entity knows of others."""

from __future__ import annotations

import math

import numpy as np

from tussle.api import GroupView, Output, Param, Sensor
from tussle.stock.sensor.noisy_contacts import kernels

PAIR = "mean sd"
FIELDS = "id team x y z vx vy vz qw qx qy qz"


class NoisyContacts(Sensor):
    """Measures every other entity of the world within range: a list of states with normal noise.

    The noise is drawn anew for each pair and call. Draws are keyed by the one who measures and the id of the one who
    is measured, so that adding entities changes no other measurement; the existing system drew them in the order of a
    hash table. Its covariance, a constant 5 on the diagonal whatever the noise, is left out: the standard deviations
    are parameters. `max_range` is new; the default is everybody, whose lists grow with the square of the number of
    entities.
    """

    grade = "portable"

    max_range = Param(math.inf, unit="m", ge=0.0, doc="Nobody further away is measured.")
    pos_noise_0 = Param((0.0, 5.0), fields=PAIR, unit="m", doc="Error of x: mean and standard deviation.")
    pos_noise_1 = Param((0.0, 5.0), fields=PAIR, unit="m", doc="Error of y.")
    pos_noise_2 = Param((0.0, 1.0), fields=PAIR, unit="m", doc="Error of z.")
    vel_noise_0 = Param((0.0, 5.0), fields=PAIR, unit="m/s", doc="Error of the velocity's x.")
    vel_noise_1 = Param((0.0, 5.0), fields=PAIR, unit="m/s", doc="Error of the velocity's y.")
    vel_noise_2 = Param((0.0, 1.0), fields=PAIR, unit="m/s", doc="Error of the velocity's z.")
    orient_noise_0 = Param((0.0, 0.0), fields=PAIR, unit="rad", doc="Turn about the contact's x axis.")
    orient_noise_1 = Param((0.0, 0.0), fields=PAIR, unit="rad", doc="Turn about the contact's y axis.")
    orient_noise_2 = Param((0.0, 0.0), fields=PAIR, unit="rad", doc="Turn about the contact's z axis.")
    contacts = Output(
        ragged=True,
        fields=FIELDS,
        unit="1 1 m m m m/s m/s m/s 1 1 1 1",
        doc="Who is measured, and where; world frame.",
    )
    n_contacts = Output(doc="Number of entities measured.")

    def step(self, g: GroupView) -> None:
        """New lists for all rows."""
        near = g.near(self.max_range)
        bodies = g.bodies
        data = np.empty((len(FIELDS.split()), len(near)))
        kernels.blur(
            (near.row, near.other, bodies.id, bodies.team), (bodies.pos, bodies.vel, bodies.quat),
            (self.pos_noise_0, self.pos_noise_1, self.pos_noise_2), (self.vel_noise_0, self.vel_noise_1, self.vel_noise_2),
            (self.orient_noise_0, self.orient_noise_1, self.orient_noise_2),
            tuple([g.normal_pairs(label, near, 3) for label in ("pos", "vel", "orient")]), data,
        )  # fmt: skip
        self.contacts.set(near.start, data)
        self.n_contacts[:] = near.count
