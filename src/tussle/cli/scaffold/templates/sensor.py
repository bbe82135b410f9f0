"""A sensor: measures after the motion of each step, for all robots at once."""

import numpy as np

from tussle.api import GroupView, Output, Param, Sensor


class New(Sensor):
    """Measures the distance to the nearest other robot, with noise; `reach` if no robot is that near."""

    grade = "portable"

    reach = Param(300.0, unit="m", gt=0.0, doc="Largest measured distance.")
    noise = Param(2.0, unit="m", ge=0.0, doc="Standard deviation of the error.")
    clearance = Output(unit="m", doc="Measured distance; an autonomy reads it with Input(unit='m').")

    def step(self, g: GroupView) -> None:
        """Measure for all robots; every array has one value per robot."""
        nearest = g.nearest(k=1)
        is_seen = (nearest.other[0] >= 0) & (nearest.distance[0] < self.reach)
        measured = np.where(is_seen, nearest.distance[0], self.reach) + self.noise * g.normal("noise")
        self.clearance[:] = np.minimum(np.maximum(measured, 0.0), self.reach)
