"""Manual commands: the axes of a joystick as channels."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from tussle import texts
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
from tussle.api.channels import CHANNEL_UNITS
from tussle.errors import ParameterError, listed, nearest_name
from tussle.stock.autonomy.joystick.device import JoystickDevice

AXIS_MAP = """[ throttle 2 -32767 +32767 -1 +1 -1 ]
    [ elevator 1 -32767 +32767 -1 +1 -1 ]
    [ aileron 0 -32767 +32767 -1 +1 +1 ]
    [ rudder 3 -32767 +32767 -1 +1 -1 ]"""
NUMBERS = "axis", "input_min", "input_max", "output_min", "output_max", "factor"


class JoystickButtons(Message):
    """Buttons of a joystick."""

    pressed = Field(ragged=True, doc="Numbers of the pressed buttons.")


class JoystickAxis(NamedTuple):
    """Mapping of a joystick axis to a channel."""

    channel: str
    axis: float
    input_min: float
    input_max: float
    output_min: float
    output_max: float
    factor: float


@cache
def axes(text: str) -> tuple[JoystickAxis, ...]:
    """Parse rows [channel axis input_min input_max output_min output_max factor].

    Raises:
        ParameterError: A row has another form, or a channel is unknown or written twice.
    """
    found = []
    for row in texts.rows(text):
        channel, _, rest = row.replace(",", " ").strip().partition(" ")
        if channel not in CHANNEL_UNITS:
            raise ParameterError(
                f"there is no channel {channel!r}{nearest_name(channel, CHANNEL_UNITS)}; {listed(CHANNEL_UNITS)}"
            )
        axis = JoystickAxis(channel, *texts.row(rest, [(name, "", "") for name in NUMBERS]))
        if axis.input_min == axis.input_max:
            raise ParameterError(f"{texts.shown(row)}: input_min and input_max are equal")
        found.append(axis)
    if len({axis.channel for axis in found}) != len(found) or not found:
        raise ParameterError(f"{texts.shown(text)} names no channel, or one twice")
    return tuple(found)


class AxisMapParam(Param):
    """The rows of a joystick; see `axes` for the errors."""

    def convert(self, value: Any, where: str = "", from_geodetic: Callable[..., Any] | None = None) -> Any:
        """Check the rows; the value is their text."""
        text = super().convert(value, where, from_geodetic)
        try:
            axes(text)
        except ParameterError as error:
            raise ParameterError(f"{self._place(where)}: {error}") from None
        return text


class Joystick:
    """Columns and methods of both plugins; abstract."""

    grade = "external"
    historic_attributes = HistoricAttributes(unread=("print_raw_joystick_values",))

    device = Param("/dev/input/js0", doc="Joystick device of the kernel.")
    axis_map = AxisMapParam(
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
        return [f"{axis.channel}_out" for axis in axes(self.axis_map)]

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
            for axis in axes(self.axis_map):
                share = (joystick.axes.get(int(axis.axis), 0) - axis.input_min) / (
                    axis.input_max - axis.input_min
                )
                value = axis.factor * (axis.output_min + share * (axis.output_max - axis.output_min))
                getattr(self, f"{axis.channel}_out")[0, row] = value
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
