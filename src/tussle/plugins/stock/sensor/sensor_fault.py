"""Sensors that fail."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from tussle.api import GroupView, Output, Sensor
from tussle.api.channel_fault import ChannelFault, ChannelsParam, channel_names
from tussle.api.channels import MEASURED_CHANNELS
from tussle.errors import ParameterError

ATTITUDE = tuple(f"belief_quat_{i}" for i in "wxyz")


class SensorFault(ChannelFault, Sensor):
    """Alters what sensors before it have measured while there is a fault; autonomies and controllers read the altered values.

    The channels are numbers that sensors earlier in the block write; the true states are not changed, nor are lists and messages of
    sensors. With the belief of `NoisyState` or `SimpleINS` the robot navigates by wrong positions or velocities. It needs the `rate`
    of these sensors, so that it alters each measurement once.

    The values of `fault` are:

    * dropout: `value`, by default 0.
    * bias: the measurement plus `value`.
    * freeze: the measurement at the beginning of the fault.
    * delay: the measurement of `delay` calls before.
    * saturate: the measurement within -`value` and `value`.
    * reverse: the measurement with the other sign.

    The attitude, four channels, can freeze and be late; the others would be no rotations.
    """

    grade = "portable"
    alters_sensors: ClassVar[bool] = True

    channels = ChannelsParam(
        "belief_pos_x belief_pos_y belief_pos_z", MEASURED_CHANNELS, doc="Channels that are altered."
    )
    for _channel, _unit in MEASURED_CHANNELS.items():
        vars()[_channel] = Output(unit=_unit, doc="Measurement.")

    def check_values(self) -> None:
        """Check that an attitude stays a rotation."""
        named = [name for name in ATTITUDE if name in channel_names(self.values["channels"])]
        if named and (len(named) < len(ATTITUDE) or self.values["fault"] not in ("freeze", "delay")):
            raise ParameterError(
                f"{type(self).__name__}: channels = {' '.join(named)} with fault = {self.values['fault']!r} is not allowed; an attitude is "
                f"the channels {' '.join(ATTITUDE)} together, and takes freeze or delay"
            )

    def offered_outputs(self) -> list[str]:
        """Return the channels that are altered."""
        return list(channel_names(self.channels))

    def step(self, g: GroupView) -> None:
        """Alter the measurements."""
        columns = [getattr(self, name) for name in channel_names(self.channels)]
        for column, row in zip(columns, self.altered(g, np.array(columns)), strict=True):
            column[:] = row
