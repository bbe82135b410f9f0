"""A radar altimeter."""

from __future__ import annotations

import numpy as np

from tussle.api import GroupView, Output, Param, Sensor


class AltitudeAboveTerrain(Sensor):
    """Measures the height of an entity above the highest surface of the scene at its place: roof, mesh, terrain or ground.

    Where the scene has no surface, it is the height above z = 0. SCRIMMAGE measures only the terrain of TerrainGenerator,
    at the corner of the cell instead of below the entity.
    """

    grade = "portable"

    altitude_noise = Param((0.0, 5.0), fields="mean sd", unit="m", doc="Error: mean and standard deviation.")
    true_altitude_above_terrain = Output(unit="m", doc="Height above the surface.")
    altitude_above_terrain = Output(unit="m", doc="The same, measured.")

    def step(self, g: GroupView) -> None:
        """Measure for all rows."""
        surface = g.scene.height(g.pos[0], g.pos[1])
        self.true_altitude_above_terrain[:] = g.pos[2] - np.where(surface > -np.inf, surface, 0.0)
        mean, sd = self.altitude_noise
        self.altitude_above_terrain[:] = self.true_altitude_above_terrain + mean + sd * g.normal("altitude")
