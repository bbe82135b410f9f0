"""Manual commands: the axes of a joystick as channels."""

from __future__ import annotations

from typing import Any

import numpy as np

from tussle.api import (
    Autonomy,
    Controller,
    Field,
    GroupView,
    Handle,
    HistoricAttributes,
    Message,
    Output,
    Param,
    Publish,
)
from tussle.api.channel_map import CHANNEL_UNITS, ChannelMapParam, channel_outputs, write_channels
from tussle.errors import ParameterError
from tussle.plugins.stock.autonomy.joystick.device import JoystickDevice

AXIS_MAP = """[ throttle 2 -32767 +32767 -1 +1 -1 ]
    [ elevator 1 -32767 +32767 -1 +1 -1 ]
    [ aileron 0 -32767 +32767 -1 +1 +1 ]
    [ rudder 3 -32767 +32767 -1 +1 -1 ]"""


class JoystickButtons(Message):
    """Buttons of a joystick."""

    pressed = Field(ragged=True, doc="Numbers of the pressed buttons.")


class Joystick:
    """Columns and methods of both plugins; abstract."""

    grade = "external"
    awaits = "a joystick at {device}"
    historic_attributes = HistoricAttributes(unread=("print_raw_joystick_values",))

    device = Param("/dev/input/js0", doc="Joystick device of the kernel.")
    axis_map = ChannelMapParam(
        AXIS_MAP, doc="Rows [channel axis input_min input_max output_min output_max factor]."
    )
    publish_button_state = Param(False, structural=True, doc="Send JoystickButtons in every call.")
    button_topic = Param("joystick_buttons", doc="Topic of JoystickButtons.")
    button_network_name = Param("LocalNetwork", doc="Its network.")
    for _channel, _unit in CHANNEL_UNITS.items():
        vars()[f"{_channel}_out"] = Output(_channel, unit=_unit, doc="Command.")
    joystick = Handle(doc="The device, opened for each entity.")
    buttons = Publish(JoystickButtons, topic_param="button_topic", network_param="button_network_name")

    def offered_outputs(self) -> list[str]:
        """Return the channels of the map."""
        return channel_outputs(self.axis_map)

    def open_one(self, row: Any) -> JoystickDevice:
        """Open the device.

        Raises:
            ParameterError: It cannot be opened.
        """
        try:
            return JoystickDevice(self.device)
        except OSError as error:
            text = f"device = {self.device!r} cannot be opened: {error.strerror}; plug in a joystick, or give its device"
            raise ParameterError(text) from None

    def close_one(self, joystick: JoystickDevice) -> None:
        """Close the device."""
        joystick.close()

    def step(self, g: GroupView) -> None:
        """Read the devices and write the channels; an axis that has not moved is 0."""
        devices: Any = self.joystick
        for row, joystick in enumerate(devices):
            try:
                joystick.poll()
            except OSError as error:
                g.fail(row, f"the joystick {self.device} is gone: {error.strerror}")
            write_channels(self, self.axis_map, row, joystick.axes, missing=0.0)
        if self.publish_button_state:
            pressed = [np.array(sorted(joystick.pressed), float) for joystick in devices]
            publisher: Any = self.buttons
            publisher.publish(np.arange(g.n), pressed=pressed)


class JoystickAutonomy(Joystick, Autonomy):
    """Writes the axes of a joystick to channels, for controllers or a motion model.

    A row of `axis_map` is [channel axis input_min input_max output_min output_max factor]: the input range is mapped to the output
    range, times the factor. All events since the last call are read (in SCRIMMAGE, one per step).

    Raises:
        ParameterError: The device cannot be opened.
    """


class JoystickController(Joystick, Controller):
    """Writes the axes of a joystick to channels of the motion model, as `JoystickAutonomy` does.

    Raises:
        ParameterError: The device cannot be opened.
    """
