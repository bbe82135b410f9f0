"""A receiver of satellite navigation, with regions without reception."""

from __future__ import annotations

import numpy as np

from tussle.api import GroupView, HistoricAttributes, Output, Param, Publish, Sensor
from tussle.declare import units
from tussle.declare.messages import GPSStatus


class GPS(Sensor):
    """Measures latitude, longitude and altitude; inside the boundaries `gps_denied_ids` there is no fix.

    Without a fix the coordinates are those of the last one, and `gps_time` is its time. `GPSStatus` is published on the network of
    the entity itself; SCRIMMAGE sent it to all entities, so that a receiver without a fix disturbed the navigation of others,
    knew only the boundary that was published last, and sent true coordinates without a fix.
    """

    grade = "portable"
    historic_attributes = HistoricAttributes(
        unread=("topic_name", "gps_lat", "gps_lon", "gps_alt", "gps_time", "gps_fix")
    )

    gps_denied_ids = Param("", doc="Ids of the boundaries without reception, separated by commas.")
    noise = Param((0.0, 0.0, 0.0), fields="x y z", unit="m", ge=0.0, doc="Standard deviation of the error.")
    coordinates = Output(
        "gps_latitude gps_longitude gps_altitude", unit="rad rad m", doc="Position on WGS84."
    )
    gps_fix = Output(doc="1 with a fix, otherwise 0.")
    gps_time = Output(unit="s", doc="Time of the last fix.")
    status = Publish(GPSStatus, network="LocalNetwork")

    def named_regions(self) -> tuple[float, ...]:
        """Return the boundaries without reception.

        Raises:
            ParameterError: `gps_denied_ids` has something other than numbers.
        """
        return tuple(
            units.parse(text, "") for text in self.values["gps_denied_ids"].replace(",", " ").split()
        )

    def spawn(self, g: GroupView, rows: np.ndarray) -> None:
        self.coordinates[:, rows] = g.scene.origin.to_geodetic(g.pos[:, rows])

    def step(self, g: GroupView) -> None:
        """Measure where there is a fix."""
        has_fix = np.ones(g.n, bool)
        for boundary in self.named_regions():
            has_fix &= ~g.region(boundary).shape.contains(g.pos)
        rows = np.flatnonzero(has_fix)
        error = self.noise * g.normal("error", 3)
        self.coordinates[:, rows] = g.scene.origin.to_geodetic((g.pos + error)[:, rows])
        self.gps_fix[:], self.gps_time[rows] = has_fix, g.t[rows]
        self.status.publish(np.arange(g.n), geodetic=self.coordinates, has_fix=has_fix, t=self.gps_time)
