"""Unicycle as in SCRIMMAGE."""

from __future__ import annotations

from tussle.api import HistoricAttributes, MotionBody, Param
from tussle.plugins.stock.motion import unicycle


class Unicycle(unicycle.Unicycle):
    """Unicycle that follows velocity_z unless a mission sets `use_pitch`, and leaves `omega` at 0.

    A climb is nose up as in tussle. In SCRIMMAGE it is nose down, with the opposite pitch_rate of `UnicyclePID` and the same paths;
    the autonomies that command pitch_rate nose up there have it nose down here.
    """

    historic_attributes = HistoricAttributes()
    use_pitch = Param(False, structural=True, doc="Follow pitch_rate; else velocity_z at constant pitch.")

    def to_body(self, body: MotionBody) -> None:
        """Write position, attitude and velocity."""
        super().to_body(body)
        body.omega[:] = 0.0
