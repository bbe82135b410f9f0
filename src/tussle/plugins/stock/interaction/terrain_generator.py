"""Random hills."""

from __future__ import annotations

from tussle.api import HistoricAttributes, Interaction, Param
from tussle.errors import ParameterError
from tussle.world.scene import HeightField


class TerrainGenerator(Interaction):
    """Adds random hills to the scene, the same in all worlds of a stack; rays meet them, and the viewer shows them.

    With RANDOM_WALK each height is the mean of its neighbours to the west, south and south-west plus a normal draw of `z_std`; LINEAR is an
    inclined plane with random slopes; LINEAR_WALK is the sum of both. The mean height is that of `center`. SCRIMMAGE draws
    with the mission's seed if `seed` is negative; here this is seed 0, because all worlds of a stack share the scene.

    Raises:
        ParameterError: `x_resolution` and `y_resolution` differ, or there are more than 4,000,000 heights.
    """

    grade = "portable"
    historic_attributes = HistoricAttributes(unread=("color",))

    technique = Param(
        "RANDOM_WALK",
        choices=("RANDOM_WALK", "LINEAR", "LINEAR_WALK"),
        structural=True,
        doc="How heights are drawn.",
    )
    x_length = Param(500.0, unit="m", gt=0.0, structural=True, doc="Extent along x.")
    y_length = Param(500.0, unit="m", gt=0.0, structural=True, doc="Extent along y.")
    x_resolution = Param(1.0, unit="m", gt=0.0, structural=True, doc="Distance between heights along x.")
    y_resolution = Param(1.0, unit="m", gt=0.0, structural=True, doc="The same along y.")
    z_std = Param(1.0, unit="m", ge=0.0, structural=True, doc="Standard deviation of a draw.")
    center = Param((0.0, 0.0, 0.0), fields="x y z", unit="m", structural=True, doc="Centre of the hills.")
    seed = Param(-1, structural=True, doc="Seed of the draws; negative is 0.")

    def terrain(self) -> HeightField:
        """Return the hills."""
        if self.x_resolution != self.y_resolution:
            raise ParameterError(
                f"TerrainGenerator: x_resolution = {self.x_resolution:g} m and y_resolution = {self.y_resolution:g} m must be equal"
            )
        x, y, z = self.center
        return HeightField.generate(
            (self.x_length, self.y_length),
            self.x_resolution,
            technique=self.technique,
            z_std=self.z_std,
            center=(x, y, z),
            seed=max(self.seed, 0),
        )
