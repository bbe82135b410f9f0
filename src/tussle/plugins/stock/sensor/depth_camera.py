"""A camera with depth and segmentation images."""

from __future__ import annotations

import math

import numpy as np

from tussle.api import GroupView, Output, Param, Sensor
from tussle.numeric import tan
from tussle.numeric.arrays import unit
from tussle.world.rays.patterns import aimed
from tussle.world.rays.solids import KINDS


class DepthCamera(Sensor):
    """Takes small images with a pinhole camera: depth, and a segmentation by parts of the scene and entities.

    One ray goes through the centre of each pixel. Pixels are listed row by row from the upper left corner of the image, so
    `np.reshape(image, (..., img_height, img_width))` is the image. The depth is measured along the optical axis, not along the ray.
    By REP 117 of ROS it is inf where nothing is within `max_range`, -inf where something is nearer than `min_range`, and nan where a
    measurement is lost (`dropout`). A depth has an error with standard
    deviation `depth_noise` + `depth_noise_square` * depth^2; the second is that of a stereo camera.

    The segmentation has no errors: `kind` is 0 where nothing is within `max_range`, 1 for ground and hills, 2 for walls and buildings, 3
    for a mesh, 4 for an entity; `id` and `team` are those of the entity, else 0 and -1; `solid` is the number in the scene's `solids`,
    else -1. The camera is mounted at `xyz` on the body, turned by `rpy`, and looks along its x axis. Set `rate` for a lower frame rate
    than that of the steps.
    """

    grade = "portable"

    img_width = Param(32, ge=1, le=512, structural=True, doc="Width of the image [pixel].")
    img_height = Param(24, ge=1, le=512, structural=True, doc="Height of the image [pixel].")
    azimuth_fov = Param(
        math.radians(80.0), unit="rad", text_unit="deg", gt=0.0, lt=math.pi, structural=True, doc="Full angle across the image.",
    )  # fmt: skip
    elevation_fov = Param(
        math.radians(64.0), unit="rad", text_unit="deg", gt=0.0, lt=math.pi, structural=True,
        doc="Full angle from its bottom to its top.",
    )  # fmt: skip
    min_range = Param(0.0, unit="m", ge=0.0, doc="Smallest depth.")
    max_range = Param(30.0, unit="m", gt=0.0, doc="Largest depth.")
    xyz = Param((0.0, 0.0, 0.0), fields="x y z", unit="m", doc="Place of the camera on the body.")
    rpy = Param(
        (0.0, 0.0, 0.0), fields="roll pitch yaw", unit="rad", text_unit="deg", doc="Attitude on the body; a positive pitch is down.",
    )  # fmt: skip
    depth_noise = Param(0.0, unit="m", ge=0.0, doc="Standard deviation of a depth of 0.")
    depth_noise_square = Param(0.0, unit="1/m", ge=0.0, doc="Its increase with the square of the depth.")
    dropout = Param(0.0, ge=0.0, le=1.0, doc="Probability that the depth of a pixel is lost.")
    sees_entities = Param(True, structural=True, doc="Whether entities are in the images.")
    depth = Output(
        "depth_image",
        unit="m",
        ragged=True,
        doc="Depth of each pixel; inf for nothing, -inf for too near, nan for lost.",
        finite=False,
    )
    segmentation = Output(
        "segmentation_image",
        fields="kind id team solid",
        ragged=True,
        doc="Part of the scene, or entity, in each pixel.",
    )

    def check_values(self) -> None:
        """Check that no lower limit is above its upper one."""
        self.check_order("min_range", "max_range")

    def step(self, g: GroupView) -> None:
        """Take an image for all rows."""
        pattern = self._pattern()
        k = pattern.shape[1]
        start, row = k * np.arange(g.n + 1), np.repeat(np.arange(g.n), k)
        origins, directions = aimed(g.pos, g.quat, self.xyz, self.rpy, pattern)
        most = self.max_range[:, None] / pattern[0]
        hits = g.cast(origins, directions, most.ravel(), row=row, entities=self.sees_entities)
        self.depth.set(start, self._depth(g, hits.distance.reshape(g.n, k) * pattern[0]).ravel())
        kind = np.where(hits.id > 0, KINDS.index("entity"), g.scene.caster.kinds[hits.solid])
        self.segmentation.set(start, np.stack([kind, hits.id, hits.team, hits.solid]).astype(float))

    def _pattern(self) -> np.ndarray:
        """Unit directions through the pixels, camera frame, (3, k)."""
        left, up = (
            tan(0.5 * angle) * (1.0 - (2.0 * np.arange(n) + 1.0) / n)
            for n, angle in ((self.img_width, self.azimuth_fov), (self.img_height, self.elevation_fov))
        )
        ways = np.broadcast_arrays(1.0, left, up[:, None])
        return np.ascontiguousarray(unit(np.stack(ways).reshape(3, -1)))

    def _depth(self, g: GroupView, depth: np.ndarray) -> np.ndarray:
        """Measured depths [m], from true ones, (n, k)."""
        k, least, most = depth.shape[1], self.min_range[:, None], self.max_range[:, None]
        is_near, is_far = depth < least, depth > most
        if self.depth_noise.any() or self.depth_noise_square.any():
            true = np.where(is_near | is_far, 0.0, depth)
            sd = self.depth_noise[:, None] + self.depth_noise_square[:, None] * true * true
            depth = np.minimum(np.maximum(depth + sd * g.normal("depth", k).T, least), most)
        depth = np.where(is_near, -math.inf, np.where(is_far, math.inf, depth))
        if self.dropout.any():
            depth = np.where((g.uniform("dropout", k) < self.dropout).T, math.nan, depth)
        return np.asarray(depth)
