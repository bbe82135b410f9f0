"""A robot whose clock is wrong for some time."""

from __future__ import annotations

import numpy as np

from tussle.api import Autonomy, Children, GroupView, Param, State
from tussle.api.channel_fault import TimedFault


class ClockOffset(TimedFault, Autonomy):
    """Runs the entity's autonomies with a clock that is wrong while there is a fault: it shows `offset` more than the true time.

    What they do at a time they do too early, or too late with a negative offset; deadlines, timeouts and times that they write into
    messages are those of the wrong clock. Autonomies that do not read the time are not affected. Steps are played at their true times:
    how often plugins are called, how long a step is, and when messages arrive is not changed. Sensors and controllers have the true time;
    a receiver with a wrong clock is a SensorFault of the channel `gps_time`.
    """

    grade = "portable"

    offset = Param(1.0, unit="s", doc="Mean of what the clock shows more than the true time.")
    offset_sd = Param(
        0.0, unit="s", ge=0.0, doc="Standard deviation of that, drawn for each entity as the fault begins."
    )
    autonomies = Children(Autonomy, shares_channels=True, doc="Its autonomies.")
    error = State(unit="s", doc="What the clock shows more than the true time while there is a fault.")

    def step(self, g: GroupView) -> None:
        """Step the autonomies with the time of the entity's clock."""
        begins = self.begin(g)
        drawn = self.offset + self.offset_sd * g.normal("offset")
        self.error[begins] = drawn[begins]
        error = np.where(self.is_faulty, self.error, 0.0)
        for plugin in self.autonomies:
            g.step(plugin, clock_error=error)
