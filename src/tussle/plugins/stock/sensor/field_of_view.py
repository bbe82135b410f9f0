"""A camera that lists the entities in its field of view."""

from __future__ import annotations

import math

import numpy as np

from tussle.api import GroupView, Output, Param, Sensor
from tussle.numeric import atan2
from tussle.numeric.quaternion import quat_from_euler, quat_multiply, quat_rotate_inverse


class FieldOfView(Sensor):
    """Measures bearing, elevation and range of every other entity in a field of view, with normal noise.

    Angles are those of the camera, which is mounted on the body by `rpy`: bearing is positive to the left, elevation up.
    With `occlusion`, an entity whose centre is hidden is not seen. Draws are keyed by the measuring entity and the id of the other.
    """

    grade = "portable"

    max_range = Param(500.0, unit="m", ge=0.0, doc="Entities further away are not seen.")
    azimuth_fov = Param(
        math.radians(90.0), unit="rad", text_unit="deg", ge=0.0, le=math.tau, doc="Full angle to both sides."
    )
    elevation_fov = Param(
        math.radians(60.0), unit="rad", text_unit="deg", ge=0.0, le=math.pi, doc="Full angle up and down."
    )
    rpy = Param(
        (0.0, 0.0, 0.0), fields="roll pitch yaw", unit="rad", text_unit="deg", doc="Attitude on the body; a positive pitch is down.",
    )  # fmt: skip
    false_negative_probability = Param(
        0.0, ge=0.0, le=1.0, doc="Probability that an entity in view is not seen."
    )
    occlusion = Param(
        False, structural=True, doc="Whether the scene and other entities hide the entities behind them."
    )
    bearing_noise = Param(0.0, unit="rad", text_unit="deg", ge=0.0, doc="Standard deviation of the bearing.")
    elevation_noise = Param(
        0.0, unit="rad", text_unit="deg", ge=0.0, doc="Standard deviation of the elevation."
    )
    range_noise = Param(0.0, ge=0.0, doc="Standard deviation of the range, as a part of it.")
    seen = Output(
        fields="id team bearing elevation range", unit="1 1 rad rad m", ragged=True, doc="Entities in view."
    )
    n_seen = Output(doc="Number of entities in view.")

    def step(self, g: GroupView) -> None:
        """Measure for all rows."""
        near = g.near(self.max_range)
        quat = quat_multiply(g.quat, quat_from_euler(*self.rpy))
        x, y, z = quat_rotate_inverse(quat[:, near.row], near.offset)
        bearing, elevation = atan2(y, x), atan2(z, np.sqrt(x * x + y * y))
        row = near.row
        is_seen = (abs(bearing) <= 0.5 * self.azimuth_fov[row]) & (
            abs(elevation) <= 0.5 * self.elevation_fov[row]
        )
        is_seen &= g.uniform_pairs("missed", near) >= self.false_negative_probability[row]
        if self.occlusion:
            is_seen[is_seen] = g.line_of_sight(row[is_seen], near.other[is_seen])
        near, row = near[is_seen], row[is_seen]
        noise = g.normal_pairs("noise", near, 3)
        bearing = bearing[is_seen] + self.bearing_noise[row] * noise[0]
        elevation = elevation[is_seen] + self.elevation_noise[row] * noise[1]
        distance = np.maximum(0.0, near.distance * (1.0 + self.range_noise[row] * noise[2]))
        self.seen.set(near.start, np.stack([near.id, near.team, bearing, elevation, distance]))
        self.n_seen[:] = near.count
