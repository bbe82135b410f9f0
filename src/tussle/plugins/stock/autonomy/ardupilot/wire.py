"""The packets of ArduPilot's simulated flight controller (SITL). All numbers are little endian.

Protocol "scrimmage", ArduPilot's model scrimmage. To ArduPilot:

    uint64 time [us]; doubles: latitude, longitude [deg], altitude [m], heading [rad], velocity north, east, down [m/s],
    acceleration forward, right, down without gravity [m/s^2], rates of roll, pitch, yaw in the body frame [rad/s], roll, pitch, yaw
    [rad], airspeed [m/s]

and from it 16 uint16: pulse widths [us]. Protocol "json", ArduPilot's model JSON (libraries/SITL/examples/JSON/readme.md). From ArduPilot:

    uint16 18458 with 16 outputs or 29569 with 32, uint16 steps per second, uint32 number of the frame, uint16 pulse widths [us]

and to it an object in a line of its own.
"""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Iterable
from typing import NamedTuple

from tussle.plugins.links.autopilots.frames import VehicleState

N_SERVOS = 32
STATE = struct.Struct("<Q17d")
SERVOS = struct.Struct("<16H")
FRAMES = {18458: struct.Struct("<HHI16H"), 29569: struct.Struct("<HHI32H")}
"""Magic number -> layout."""


class ServoFrame(NamedTuple):
    """Outputs of ArduPilot.

    Attributes:
        pulses: Pulse widths [us] by number of the output; those without pulses are missing.
        number: Number of the frame; -1 if it has none.
    """

    pulses: dict[int, float]
    number: int


def encode_state(state: VehicleState) -> bytes:
    """A state, by the protocol "scrimmage"."""
    latitude, longitude, altitude = state.geodetic
    return STATE.pack(
        max(round(1e6 * state.t), 0), math.degrees(latitude), math.degrees(longitude), altitude, state.euler[2], *state.velocity,
        *state.acceleration, *state.rate, *state.euler, state.speed,
    )  # fmt: skip


def decode_servos(data: bytes) -> ServoFrame:
    """The answer, by the protocol "scrimmage".

    Raises:
        ValueError: This is none.
    """
    if len(data) != SERVOS.size:
        raise ValueError(f"a packet of {len(data)} bytes; servo packets have {SERVOS.size}")
    return ServoFrame(_pulses(SERVOS.unpack(data)), -1)


def encode_json(state: VehicleState) -> bytes:
    """A state, by the protocol "json"."""
    fields = {
        "timestamp": state.t, "imu": {"gyro": state.rate, "accel_body": state.force}, "position": state.position,
        "attitude": state.euler, "quaternion": state.quat, "velocity": state.velocity,
    }  # fmt: skip
    return f"\n{json.dumps(fields, separators=(',', ':'))}\n".encode()


def decode_frame(data: bytes) -> ServoFrame:
    """The answer, by the protocol "json".

    Raises:
        ValueError: This is none.
    """
    magic = int.from_bytes(data[:2], "little")
    layout = FRAMES.get(magic)
    if layout is None or len(data) != layout.size:
        sizes = " or ".join(f"{known} with {each.size} bytes" for known, each in FRAMES.items())
        raise ValueError(f"a packet of {len(data)} bytes that begins with {magic}; frames begin with {sizes}")
    _, _, number, *pulses = layout.unpack(data)
    return ServoFrame(_pulses(pulses), number)


def _pulses(widths: Iterable[int]) -> dict[int, float]:
    """The outputs that have pulses."""
    return {k: float(width) for k, width in enumerate(widths) if width}
