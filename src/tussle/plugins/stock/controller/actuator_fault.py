"""Actuators that fail."""

from __future__ import annotations

import numpy as np

from tussle.api import Controller, GroupView, Input, Output
from tussle.api.channel_fault import ChannelFault, ChannelsParam, channel_names
from tussle.api.channel_map import CHANNEL_UNITS


class ActuatorFault(ChannelFault, Controller):
    """Passes channels on, and alters some of them while there is a fault: an actuator that is off, stuck, saturated, reversed or late.

    It stands before the plugin that reads the channels: after the controllers it acts on the inputs of the motion model, before them on
    what the autonomies want. With the fault `dropout` and speed or velocity it is a robot that stops. Channels in `channels` are altered,
    those in `passed` are not; others are not passed.

    The values of `fault` are:

    * dropout: `value`, by default 0.
    * bias: the command plus `value`.
    * freeze: the command at the beginning of the fault; the actuator is stuck.
    * delay: the command of `delay` calls before.
    * saturate: the command within -`value` and `value`.
    * reverse: the command with the other sign.
    """

    grade = "portable"

    channels = ChannelsParam(
        "velocity_x velocity_y velocity_z", CHANNEL_UNITS, doc="Channels that are altered."
    )
    passed = ChannelsParam("", CHANNEL_UNITS, at_least=0, doc="Channels that are passed unaltered.")
    for _channel, _unit in CHANNEL_UNITS.items():
        vars()[f"{_channel}_in"] = Input(_channel, unit=_unit, doc="Command.")
        vars()[f"{_channel}_out"] = Output(_channel, unit=_unit, doc="Command passed on.")

    def _both(self) -> tuple[str, ...]:
        altered, passed = channel_names(self.channels), channel_names(self.passed)
        return altered + tuple(name for name in passed if name not in altered)

    def active_inputs(self) -> list[str]:
        """Return the inputs of the channels that are named."""
        return [f"{name}_in" for name in self._both()]

    def offered_outputs(self) -> list[str]:
        """Return the outputs of the channels that are named."""
        return [f"{name}_out" for name in self._both()]

    def step(self, g: GroupView) -> None:
        """Pass the channels on."""
        names = self._both()
        given = np.array([getattr(self, f"{name}_in")[0] for name in names])
        k = len(channel_names(self.channels))
        given[:k] = self.altered(self.begin(g), given[:k])
        for name, row in zip(names, given, strict=True):
            getattr(self, f"{name}_out")[0] = row
