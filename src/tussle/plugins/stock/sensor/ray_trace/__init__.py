"""A lidar."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from tussle.api import GroupView, HistoricAttributes, Output, Param, Publish, Sensor, State, service
from tussle.declare.messages import PointCloud
from tussle.numeric import cos, sin
from tussle.numeric.quaternion import quat_from_euler, quat_rotate
from tussle.plugins.stock.sensor.ray_trace import kernels
from tussle.world.rays.patterns import ScanPattern, aimed

FIELDS, UNITS = "x y z range in_range", "m m m m 1"


class RayTrace(Sensor):
    """A lidar: measures distances along a pattern of rays, which end at the scene and at other entities.

    The rays of a scan spread evenly about the sensor's x axis: `num_rays_horiz` angles, `angle_res_horiz` apart, for each of
    `num_rays_vert` elevations, from the highest down. The sensor is mounted at `xyz` on the body, turned by `rpy`.

    A ray that is not in range has a range by REP 117 of ROS: inf if it meets nothing within `max_range`, -inf if it meets something nearer
    than `min_range`, nan if its return is lost (`dropout`). Its end is at `max_range`, or at `min_range` if its range is -inf.

    In SCRIMMAGE all of these have the range `max_range`. It leaves the casting to BulletCollision, whose points are in the sensor's
    frame and begin at the body's centre whatever `xyz` is; it reads a position noise and does not apply it. It calls the period
    `max_sample_rate`, which missions may write too.
    """

    grade = "portable"
    historic_attributes = HistoricAttributes(
        renamed={"max_sample_rate": "scan_period"},
        unread=("pos_noise_0", "pos_noise_1", "pos_noise_2", "auto_ray_tracing"),
    )

    angle_res_vert = Param(
        math.radians(45.0), unit="rad", text_unit="deg", structural=True, doc="Angle between two elevations."
    )
    num_rays_vert = Param(1, ge=1, le=10_000, structural=True, doc="Number of elevations.")
    angle_res_horiz = Param(
        math.radians(2.0),
        unit="rad",
        text_unit="deg",
        structural=True,
        doc="Angle between two rays of one elevation.",
    )
    num_rays_horiz = Param(20, ge=1, le=10_000, structural=True, doc="Number of rays of one elevation.")
    max_range = Param(30.0, unit="m", gt=0.0, doc="Largest range.")
    min_range = Param(0.0, unit="m", ge=0.0, doc="Smallest range.")
    scan_period = Param(0.1, unit="s", ge=0.0, doc="Time between two scans.")
    xyz = Param((0.0, 0.0, 0.0), fields="x y z", unit="m", doc="Place of the sensor on the body.")
    rpy = Param(
        (0.0, 0.0, 0.0),
        fields="roll pitch yaw",
        unit="rad",
        text_unit="deg",
        doc="Attitude on the body; a positive pitch is down.",
    )
    range_noise = Param(0.0, unit="m", ge=0.0, doc="Standard deviation of a range.")
    dropout = Param(0.0, ge=0.0, le=1.0, doc="Probability that a return is lost.")
    sees_entities = Param(True, structural=True, doc="Whether entities stop the rays.")
    publish_on_local_networks = Param(
        False, structural=True, doc="Send each scan as a PointCloud to the entity's other plugins."
    )
    points = Output(
        "raytrace",
        fields=FIELDS,
        unit=UNITS,
        ragged=True,
        doc="Ends of the rays, body frame, and their ranges: inf for nothing, -inf for too near, nan for lost.",
        finite=False,
    )
    cloud = Publish(PointCloud, network="LocalNetwork")
    next_scan = State(default=-math.inf, unit="s", doc="Time of the next scan.")

    def check_values(self) -> None:
        """Check that no lower limit is above its upper one."""
        self.check_order("min_range", "max_range")

    def step(self, g: GroupView) -> None:
        """Scan in the rows whose next scan is due."""
        rows = np.flatnonzero(g.t >= self.next_scan - 1e-9)
        if not len(rows):
            return
        # Counted from the last scan, so that scans keep their rate whatever the step is.
        last = np.where(self.next_scan[rows] > -math.inf, self.next_scan[rows], g.t[rows])
        self.next_scan[rows] = np.maximum(last + self.scan_period[rows], g.t[rows] - self.scan_period[rows])
        pattern = self._pattern()
        k = pattern.shape[1]
        scan = self._scan(g, rows, pattern)
        if len(rows) < g.n:  # the others keep their last scans
            all_points = np.empty((5, g.n, k))
            others = np.setdiff1d(np.arange(g.n), rows)
            kept = self.points.start[others][:, None] + np.arange(k)
            all_points[:, others], all_points[:, rows] = self.points.data[:, kept], scan.reshape(5, -1, k)
            scan = all_points.reshape(5, -1)
        self.points.set(k * np.arange(g.n + 1), scan)
        if self.publish_on_local_networks:
            self.cloud.publish(rows, points=[scan[:, row * k : (row + 1) * k] for row in rows])

    @service
    def scan_pattern(self, g: GroupView) -> Callable[[int], ScanPattern]:
        """Return a function that tells how the lidar of a row scans, for plugins that pass scans on."""
        quats = quat_from_euler(*self.rpy)

        def of(row: int) -> ScanPattern:
            period = float(self.scan_period[row])
            return ScanPattern(
                self.xyz[:, row], quats[:, row], self.angle_res_horiz, self.num_rays_vert,
                float(self.min_range[row]), float(self.max_range[row]), period,
                min(float(g.t[row]), float(self.next_scan[row]) - period),
            )  # fmt: skip

        return of

    def _pattern(self) -> np.ndarray:
        """Unit directions of the rays, sensor frame, (3, k)."""
        elevation, azimuth = (
            angle * (np.arange(n) - 0.5 * (n - 1))
            for n, angle in (
                (self.num_rays_vert, self.angle_res_vert),
                (self.num_rays_horiz, self.angle_res_horiz),
            )
        )
        down, level = sin(elevation)[:, None], cos(elevation)[:, None]
        ways = np.broadcast_arrays(level * cos(azimuth), level * sin(azimuth), -down)
        return np.ascontiguousarray(np.stack(ways).reshape(3, -1))

    def _scan(self, g: GroupView, rows: np.ndarray, pattern: np.ndarray) -> np.ndarray:
        """Points of the scans of some rows, (5, m k)."""
        m, k = len(rows), pattern.shape[1]
        turn = np.ascontiguousarray(quat_from_euler(*self.rpy[:, rows]))
        origins, directions = aimed(
            g.pos[:, rows], g.quat[:, rows], self.xyz[:, rows], self.rpy[:, rows], pattern
        )
        limit = np.repeat(self.max_range[rows], k)
        hits = g.cast(origins, directions, limit, row=np.repeat(rows, k), entities=self.sees_entities)
        distance = hits.distance
        if self.range_noise.any():
            distance = distance + (self.range_noise * g.normal("range", k))[:, rows].T.ravel()
        if self.dropout.any():
            distance = np.where(
                (g.uniform("dropout", k) < self.dropout)[:, rows].T.ravel(), math.nan, distance
            )
        axes = [
            quat_rotate(turn, np.repeat([[float(a == b)] for b in range(3)], m, axis=1)) for a in range(3)
        ]
        mount = np.ascontiguousarray(np.concatenate([self.xyz[:, rows], *axes]))
        scan = np.empty((5, m * k))
        limits = self.min_range[rows], self.max_range[rows]
        kernels.points(mount, pattern, distance, limits, self._near_end(rows), scan)
        return scan

    def _near_end(self, rows: np.ndarray) -> np.ndarray:
        """Distance along the rays at which those end that are nearer than `min_range` [m], (m,)."""
        return np.asarray(self.min_range[rows])
