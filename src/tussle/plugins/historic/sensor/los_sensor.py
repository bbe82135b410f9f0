"""A laser range finder as in SCRIMMAGE."""

from __future__ import annotations

from tussle.api import HistoricAttributes, Param
from tussle.plugins.stock.sensor import los_sensor as stock


class LOSSensor(stock.LOSSensor):
    """The range is `oor_return`, 150 m, also where the ground is nearer than `min_range`, and that to the scene by default.

    Without `min_range` and `max_range` both are 1 m. SCRIMMAGE's file of the plugin spells `use_flat_earth` with another
    underscore, so its value there has no effect.
    """

    historic_attributes = HistoricAttributes(
        unread=("use_flat_earth_", *stock.LOSSensor.historic_attributes.unread)
    )

    min_range = Param(1.0, unit="m", ge=0.0, doc="Smallest range.")
    max_range = Param(1.0, unit="m", ge=0.0, doc="Largest range.")
    oor_return = Param(150.0, unit="m", doc="Range that is reported out of range.")
    use_flat_earth = Param(
        False, structural=True, doc="See the plane z = 0 only; otherwise ground and walls of the scene."
    )
    tells_near = False
