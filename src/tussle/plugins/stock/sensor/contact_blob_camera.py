"""A camera whose images are boxes around entities."""

from __future__ import annotations

import math

import numpy as np

from tussle.api import GroupView, HistoricAttributes, Output, Param, Sensor
from tussle.numeric import clip, tan
from tussle.numeric.quaternion import quat_from_euler, quat_multiply, quat_rotate_inverse

PAIR = "mean sd"
RADII = (0.1, 20.0)
"""Smallest and largest half width of a false positive [pixel]."""


class ContactBlobCamera(Sensor):
    """Lists boxes around the entities in the image of a pinhole camera, with missed entities, noise and false positives.

    A box is that of the entity's sphere of `radius`: an axis is bounded by the tangents of its angle plus and minus
    asin(radius / distance). Pixels count from the upper left corner of the image, u to the right and v down; boxes end at its edges. A
    false positive has id 0; the other ids are true, for scoring. The camera looks along the body's x axis, turned by `rpy`. With
    `occlusion`, an entity whose centre is hidden is not seen. Set `rate` for a lower frame rate than that of the steps.

    In SCRIMMAGE the size is the widest chord's, and each detected entity brings its own false positives of its own size,
    one more than `max_false_positives_per_frame`, and none come without one. Its focal length cancels. It also lists entities above and
    below the corners of the image, whose elevation over the horizontal plane of the camera is within `elevation_fov`.
    """

    grade = "portable"
    historic_attributes = HistoricAttributes(
        unread=(
            "camera_id", "focal_length", "frames_per_second", "std_dev_width", "std_dev_height", "log_detections", "window_name",
            "simulated_detections",
        )
    )  # fmt: skip

    img_width = Param(800.0, gt=0.0, doc="Width of the image [pixel].")
    img_height = Param(600.0, gt=0.0, doc="Height of the image [pixel].")
    max_detect_range = Param(2000.0, unit="m", ge=0.0, doc="Entities further away are not seen.")
    azimuth_fov = Param(
        math.radians(45.0),
        unit="rad",
        text_unit="deg",
        gt=0.0,
        lt=math.pi,
        doc="Full angle across the image.",
    )
    elevation_fov = Param(
        math.radians(45.0),
        unit="rad",
        text_unit="deg",
        gt=0.0,
        lt=math.pi,
        doc="Full angle from its bottom to its top.",
    )
    rpy = Param(
        (0.0, 0.0, 0.0), fields="roll pitch yaw", unit="rad", text_unit="deg", doc="Attitude on the body; a positive pitch is down.",
    )  # fmt: skip
    false_negative_probability = Param(
        0.1, ge=0.0, le=1.0, doc="Probability that an entity in view is missed."
    )
    false_positive_probability = Param(
        0.1, ge=0.0, le=1.0, doc="Probability of each possible false positive."
    )
    max_false_positives_per_frame = Param(
        10, ge=0, le=1000, structural=True, doc="Number of possible false positives."
    )
    occlusion = Param(
        False, structural=True, doc="Whether the scene and other entities hide the entities behind them."
    )
    pos_noise_0 = Param((0.0, 1.0), fields=PAIR, doc="Error of u: mean and standard deviation [pixel].")
    pos_noise_1 = Param((0.0, 1.0), fields=PAIR, doc="Error of v [pixel].")
    size_noise_0 = Param((0.0, 0.0), fields=PAIR, doc="Error of the width [pixel].")
    size_noise_1 = Param((0.0, 0.0), fields=PAIR, doc="Error of the height [pixel].")
    ignore_real_entities = Param(False, doc="See false positives only.")
    blobs = Output(
        fields="id u v width height", ragged=True, doc="Entity, centre and size of each box [pixel]."
    )

    def step(self, g: GroupView) -> None:
        """Take an image for all rows."""
        (row, *seen), (empty, *false) = self._boxes(g), self._false_positives(g)
        row, boxes = np.append(row, empty), np.concatenate([np.stack(seen), np.stack(false)], axis=1)
        order = np.argsort(row, kind="stable")
        start = np.searchsorted(row[order], np.arange(g.n + 1))
        self.blobs.set(start, boxes[:, order])

    def _boxes(self, g: GroupView) -> tuple[np.ndarray, ...]:
        """Row, id, u, v, width and height of the entities seen, each (m,)."""
        near = g.near(self.max_detect_range)
        quat = quat_multiply(g.quat, quat_from_euler(*self.rpy))
        x, y, z = quat_rotate_inverse(quat[:, near.row], near.offset)
        row, side, up = near.row, tan(0.5 * self.azimuth_fov), tan(0.5 * self.elevation_fov)
        is_seen = (x > 0.0) & (abs(y) <= x * side[row]) & (abs(z) <= x * up[row])
        is_seen &= ~self.ignore_real_entities[row]
        is_seen &= g.uniform_pairs("missed", near) >= self.false_negative_probability[row]
        if self.occlusion:
            is_seen[is_seen] = g.line_of_sight(row[is_seen], near.other[is_seen])
        near, row, x, y, z = near[is_seen], row[is_seen], x[is_seen], y[is_seen], z[is_seen]
        noise = g.normal_pairs("noise", near, 4)
        across = self.img_width, side, -y, (self.pos_noise_0, self.size_noise_0), noise[0::2]
        down = self.img_height, up, -z, (self.pos_noise_1, self.size_noise_1), noise[1::2]
        (u, width), (v, height) = (
            _extent(x, offset, near.radius, size[row], half[row], [e[:, row] for e in errors], draws)
            for size, half, offset, errors, draws in (across, down)
        )
        return row, near.id, u, v, width, height

    def _false_positives(self, g: GroupView) -> tuple[np.ndarray, ...]:
        """Row, id, u, v, width and height of the false positives, each (m,)."""
        k = self.max_false_positives_per_frame
        draws = g.uniform("false", 4 * k).reshape(4, k, g.n)
        row, slot = np.nonzero((draws[0] < self.false_positive_probability).T)
        _, u, v, size = draws[:, slot, row]
        width = 2.0 * (RADII[0] + (RADII[1] - RADII[0]) * size)
        return row, np.zeros(len(row)), u * self.img_width[row], v * self.img_height[row], width, width


def _extent(
    x: np.ndarray, offset: np.ndarray, radius: np.ndarray, size: np.ndarray, half: np.ndarray, errors: list[np.ndarray], draws: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Centre and width of boxes along an axis of the image [pixel], (m,) each.

    Args:
        x: Distance of the entities along the optical axis [m], (m,).
        offset: Distance along the axis of the image, to the right or down [m], (m,).
        radius: Radii of the entities [m], (m,).
        size: Size of the image [pixel], (m,).
        half: Tangent of half the field of view, (m,).
        errors: Mean and standard deviation of position and size [pixel], (2, m) each.
        draws: Standard normal draws for both, (2, m).
    """
    slope, square = offset / x, x * x + offset * offset - radius * radius
    # Tangent of the sphere's half angle. A camera inside the sphere sees it in all directions.
    tangent = radius / np.sqrt(np.maximum(square, 1e-12))
    low, high = (_turned(slope, sign * tangent, sign * np.inf) for sign in (-1.0, 1.0))
    low, high = (0.5 * size * (1.0 + clip(edge / half, -1.0, 1.0)) for edge in (low, high))
    (mean, sd), (mean_size, sd_size) = errors
    center = 0.5 * (low + high) + mean + sd * draws[0]
    return center, np.maximum(0.0, high - low + mean_size + sd_size * draws[1])


def _turned(slope: np.ndarray, tangent: np.ndarray, beyond: float) -> np.ndarray:
    """Tangent of the sum of two angles, given by their tangents; `beyond` where the sum reaches a right angle."""
    rest = 1.0 - slope * tangent
    return np.where(rest > 0.0, (slope + tangent) / np.where(rest > 0.0, rest, 1.0), beyond)


class ContactBlobCameraNoNoise(ContactBlobCamera):
    """A ContactBlobCamera without errors: the centres of the boxes are exact, no entity is missed, and there are no false positives."""

    false_negative_probability = Param(
        0.0, ge=0.0, le=1.0, doc="Probability that an entity in view is missed."
    )
    false_positive_probability = Param(
        0.0, ge=0.0, le=1.0, doc="Probability of each possible false positive."
    )
    max_false_positives_per_frame = Param(
        0, ge=0, le=1000, structural=True, doc="Number of possible false positives."
    )
    pos_noise_0 = Param((0.0, 0.0), fields=PAIR, doc="Error of u: mean and standard deviation [pixel].")
    pos_noise_1 = Param((0.0, 0.0), fields=PAIR, doc="Error of v [pixel].")
