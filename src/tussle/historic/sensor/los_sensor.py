"""A laser range finder as in SCRIMMAGE."""

from __future__ import annotations

from tussle.api import Param
from tussle.stock.sensor.los_sensor import plugin as stock


class LOSSensor(stock.LOSSensor):
    """The range is `oor_return`, 150 m, also where the ground is nearer than `min_range`."""

    oor_return = Param(150.0, unit="m", doc="Range that is reported out of range.")
    tells_near = False
