"""A Unicycle3D that integrates its turn since the start."""

from __future__ import annotations

import numpy as np

from tussle.api import MotionBody, State
from tussle.historic.motion.unicycle_3d import kernels
from tussle.numeric.quaternion import quat_conjugate
from tussle.stock.motion import unicycle_3d


class Unicycle3D(unicycle_3d.Unicycle3D):
    """Unicycle3D whose attitude is integrated as the turn since the start, by RK4 with a pull towards length 1.

    So the rates act about axes that move with the vehicle but were the world's at the start, the body's own only where it started
    with (1, 0, 0, 0); tussle takes the body's own always. And attitude and path carry RK4's errors, 2e-5 m where a turn at full
    rate ends at 25 m/s; tussle's attitude is exact for held rates. Different are the kernel, and the start attitude kept for it.
    """

    x = State(
        "x y z qw qx qy qz v iw ix iy iz",
        unit="m m m 1 1 1 1 m/s 1 1 1 1",
        doc="As of the stock plugin, and the inverse of the start attitude.",
    )

    advance = kernels.advance

    def from_body(self, body: MotionBody, rows: np.ndarray) -> None:
        """Copy position, attitude and speed, and keep the attitude as that of the start."""
        super().from_body(body, rows)
        self.x[8:12, rows] = quat_conjugate(self.x[3:7, rows])
