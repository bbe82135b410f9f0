"""A laser range finder along one line of sight."""

from __future__ import annotations

import math

import numpy as np

from tussle.api import GroupView, HistoricAttributes, Output, Param, Sensor
from tussle.numeric.quaternion import quat_from_euler, quat_multiply, quat_rotate


class LOSSensor(Sensor):
    """Measures the range of the ground along a line of sight: a laser altimeter, if `rpy` turns it down.

    The line begins at `xyz` on the body and points along its x axis, turned by `rpy`. The range is `oor_return` where nothing is within
    `max_range`, and -inf where the ground is nearer than `min_range` (REP 117 of ROS). With the probability `probability_oor_error` a
    measurement is wrong about the limits: one in range is reported as beyond `max_range`, and one out of range as the nearest limit. A
    range has an error with standard deviation `range_sd_min` + `range_sd_per_unit` * range, and with `probability_of_error` another one of
    `error_sd`.

    In SCRIMMAGE `oor_return` is 150 m, and the range where the ground is too near. It uses the limits only if `probability_oor_error`
    is not 0, does not repeat its draws, and sees the scene unless `use_flat_earth` is true.
    """

    grade = "portable"
    historic_attributes = HistoricAttributes(
        renamed={"use_flat_earth_": "use_flat_earth"},
        unread=(
            "sensor_id", "max_sample_rate", "angle_res_vert", "num_rays_vert", "angle_res_horiz", "num_rays_horiz",
            "pos_noise_0", "pos_noise_1", "pos_noise_2",
        ),
    )  # fmt: skip

    min_range = Param(0.0, unit="m", ge=0.0, doc="Smallest range.")
    max_range = Param(30.0, unit="m", ge=0.0, doc="Largest range.")
    xyz = Param((0.0, 0.0, 0.0), fields="x y z", unit="m", doc="Place of the sensor on the body.")
    rpy = Param(
        (0.0, 0.0, 0.0), fields="roll pitch yaw", unit="rad", text_unit="deg", doc="Attitude on the body; a pitch of 90 degrees is down.",
    )  # fmt: skip
    range_sd_min = Param(0.001, unit="m", ge=0.0, doc="Standard deviation at range 0.")
    range_sd_per_unit = Param(0.01, ge=0.0, doc="Increase of the standard deviation with the range.")
    range_sd_oor = Param(10.0, unit="m", ge=0.0, doc="Standard deviation that is reported out of range.")
    oor_return = Param(math.inf, unit="m", doc="Range that is reported where nothing is within `max_range`.")
    probability_of_error = Param(0.05, ge=0.0, le=1.0, doc="Probability of an additional error.")
    error_sd = Param(0.5, unit="m", ge=0.0, doc="Standard deviation of the additional error.")
    probability_oor_error = Param(
        0.015, ge=0.0, le=1.0, doc="Probability that in and out of range are confused."
    )
    use_flat_earth = Param(
        True, structural=True, doc="See the plane z = 0 only; otherwise ground and walls of the scene."
    )
    tells_near = True
    """Whether a range below `min_range` is reported as -inf, not as `oor_return`."""
    los_range = Output(unit="m", doc="Measured range; inf for nothing, -inf for too near.", finite=False)
    los_sd = Output(unit="m", doc="Its standard deviation.")
    is_in_range = Output(doc="1 within the limits, otherwise 0.")

    def check_values(self) -> None:
        """Check that no lower limit is above its upper one."""
        self.check_order("min_range", "max_range")

    def step(self, g: GroupView) -> None:
        """Measure for all rows."""
        true = self._distance(g)
        draw, noise = g.uniform("errors", 2), g.normal("noise", 2)
        is_in = (true >= self.min_range) & (true <= self.max_range)
        is_in ^= draw[0] < self.probability_oor_error
        found = self._limited(true)
        found = self._limited(
            found + np.where(draw[1] < self.probability_of_error, self.error_sd * noise[0], 0.0)
        )
        sd = self.range_sd_min + self.range_sd_per_unit * found
        found = self._limited(found + sd * noise[1])
        is_near = (true < self.min_range) if self.tells_near else np.zeros(g.n, bool)
        self.los_range[:] = np.where(is_in, found, np.where(is_near, -math.inf, self.oor_return))
        self.los_sd[:] = np.where(is_in, sd, self.range_sd_oor)
        self.is_in_range[:] = is_in

    def _limited(self, distance: np.ndarray) -> np.ndarray:
        return np.asarray(np.minimum(np.maximum(distance, self.min_range), self.max_range))

    def _distance(self, g: GroupView) -> np.ndarray:
        """Distance along the line of sight [m], (n,); inf where it hits nothing."""
        origin = g.pos + quat_rotate(g.quat, self.xyz)
        quat = quat_multiply(g.quat, quat_from_euler(*self.rpy))
        way = quat_rotate(quat, np.stack([np.ones(g.n), np.zeros(g.n), np.zeros(g.n)]))
        if not self.use_flat_earth:
            return g.cast(origin, way, entities=False).distance
        sinks = (way[2] < 0.0) & (origin[2] >= 0.0)
        return np.where(sinks, origin[2] / np.where(sinks, -way[2], 1.0), math.inf)
