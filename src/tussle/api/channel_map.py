"""Channels of a vehicle that are driven by numbered inputs: axes of a joystick, servos of an autopilot."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any, NamedTuple

from tussle.declare import texts
from tussle.declare.columns import Param
from tussle.errors import ParameterError, listed, nearest_name

CHANNEL_UNITS = {
    "desired_speed": "m/s", "desired_altitude": "m", "desired_heading": "rad", "desired_roll": "rad", "speed": "m/s",
    "velocity_x": "m/s", "velocity_y": "m/s", "velocity_z": "m/s", "turn_rate": "rad/s", "pitch_rate": "rad/s", "roll_rate": "rad/s",
    "acceleration_x": "m/s^2", "acceleration_y": "m/s^2", "acceleration_z": "m/s^2", "throttle": "", "thrust": "", "elevator": "",
    "aileron": "", "rudder": "", **{f"motor_{i}": "rad/s" for i in range(8)}, "desired_pitch": "rad", "steering": "rad",
    "x_thrust": "m/s^2", "y_thrust": "m/s^2", "z_thrust": "m/s^2", "turn_force": "rad/s^2",
}  # fmt: skip
"""Numbers that motion models and controllers that ship read, and their units."""

_AXES = "xyz"
MEASURED_CHANNELS = {
    **{f"belief_pos_{i}": "m" for i in _AXES}, **{f"belief_vel_{i}": "m/s" for i in _AXES}, **{f"belief_quat_{i}": "" for i in "wxyz"},
    **{f"measured_pos_{i}": "m" for i in _AXES}, **{f"body_velocity_{i}": "m/s" for i in _AXES},
    **{f"body_rate_{i}": "rad/s" for i in _AXES}, **{f"body_acceleration_{i}": "m/s^2" for i in _AXES},
    **{f"body_rate_change_{i}": "rad/s^2" for i in _AXES}, "true_altitude_above_terrain": "m", "altitude_above_terrain": "m",
    "gps_latitude": "rad", "gps_longitude": "rad", "gps_altitude": "m", "gps_fix": "", "gps_time": "s", "los_range": "m", "los_sd": "m",
    "is_in_range": "", "ins_cep": "m", "n_seen": "", "n_contacts": "",
}  # fmt: skip
"""All numbers that sensors that ship write."""

MEASURED_LISTS = {
    "contacts": ("id team x y z vx vy vz qw qx qy qz", "1 1 m m m m/s m/s m/s 1 1 1 1"),
    "seen": ("id team bearing elevation range", "1 1 rad rad m"), "blobs": ("id u v width height", ""),
    "depth_image": ("", "m"), "segmentation_image": ("kind id team solid", ""), "observation": ("value", ""),
}  # fmt: skip
"""Fields of all lists that sensors that ship write anew in each call, and their units."""


NUMBERS = "number", "input_min", "input_max", "output_min", "output_max", "factor"


class ChannelRow(NamedTuple):
    """How an input drives a channel: the input range is mapped linearly to the output range, times the factor."""

    channel: str
    number: int
    input_min: float
    input_max: float
    output_min: float
    output_max: float
    factor: float

    def value(self, x: float) -> float:
        """The channel for an input."""
        share = (x - self.input_min) / (self.input_max - self.input_min)
        return self.factor * (self.output_min + share * (self.output_max - self.output_min))


@cache
def channel_rows(text: str) -> tuple[ChannelRow, ...]:
    """Parse rows [channel number input_min input_max output_min output_max factor].

    Raises:
        ParameterError: A row has another form, or a channel is unknown or written twice.
    """
    found = []
    for row in texts.rows(text):
        channel, _, rest = row.replace(",", " ").strip().partition(" ")
        if channel not in CHANNEL_UNITS:
            near = nearest_name(channel, CHANNEL_UNITS)
            raise ParameterError(f"there is no channel {channel!r}{near}; {listed(CHANNEL_UNITS)}")
        number, *limits = texts.row(rest, [(name, "", "") for name in NUMBERS])
        if number != int(number) or number < 0.0:
            raise ParameterError(
                f"{texts.shown(row)}: number = {number:g}; it takes a whole number from 0 on"
            )
        if limits[0] == limits[1]:
            raise ParameterError(f"{texts.shown(row)}: input_min and input_max are equal")
        found.append(ChannelRow(channel, int(number), *limits))
    if len({row.channel for row in found}) != len(found) or not found:
        raise ParameterError(f"{texts.shown(text)} names no channel, or one twice")
    return tuple(found)


class ChannelMapParam(Param):
    """The rows of a channel map, as text; see `channel_rows` for the errors.

    Args:
        default: The rows.
        n_inputs: Number of inputs; None if it is not known.
        doc: One-line description.
    """

    def __init__(self, default: str, *, n_inputs: int | None = None, doc: str = "") -> None:
        self.n_inputs = n_inputs
        super().__init__(default, structural=True, doc=doc)

    def convert(self, value: Any, where: str = "", from_geodetic: Callable[..., Any] | None = None) -> Any:
        """Check the rows; the value is their text."""
        text = super().convert(value, where, from_geodetic)
        try:
            for row in channel_rows(text):
                if self.n_inputs is not None and row.number >= self.n_inputs:
                    raise ParameterError(
                        f"{row.channel} has the number {row.number}; it takes 0 to {self.n_inputs - 1}"
                    )
        except ParameterError as error:
            raise ParameterError(f"{self._place(where)}: {error}") from None
        return text


def channel_outputs(text: str) -> list[str]:
    """Names of the outputs of the channels of a map, for `offered_outputs`."""
    return [f"{row.channel}_out" for row in channel_rows(text)]


def write_channels(
    plugin: Any, text: str, row: int, inputs: Mapping[int, float], missing: float | None = None
) -> None:
    """Write the channels of an entity from its inputs by number.

    A channel whose input is not there is 0, or follows the input `missing`.
    """
    for channel in channel_rows(text):
        x = inputs.get(channel.number, missing)
        getattr(plugin, f"{channel.channel}_out")[0, row] = 0.0 if x is None else channel.value(x)
