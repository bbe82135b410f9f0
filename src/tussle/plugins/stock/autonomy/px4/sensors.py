"""What the sensors of a vehicle measure, as messages of MAVLink's common dialect (https://mavlink.io/en/messages/common.html)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from tussle.plugins.links.autopilots.frames import VehicleState

# U.S. Standard Atmosphere, 1976: table 4 and equation 33a with its constants, up to 11 km.
SEA_LEVEL_PRESSURE = 1013.25  # [hPa]
SEA_LEVEL_TEMPERATURE = 288.15  # [K]
LAPSE_RATE = 0.0065  # [K/m]
EXPONENT = 9.80665 * 0.0289644 / (8.31432 * LAPSE_RATE)
GAS_CONSTANT = 287.053  # of dry air [J/(kg K)]
HIGHEST = 11000.0  # [m]
ZERO_CELSIUS = 273.15  # [K]
MILLI_G = 9.80665e-3  # [m/s^2]
INERTIAL, SLOW = 0x3F, 0x1FC0
"""HIL_SENSOR_UPDATED_FLAGS: accelerometer and gyroscope; magnetometer, pressures, altitude and temperature."""
FIX_3D = 3
N_SATELLITES = 10
POSITION_ERROR = 100  # [cm]
UNKNOWN_YAW = 0


def atmosphere(altitude: float) -> tuple[float, float, float]:
    """Pressure [hPa], temperature [K] and density [kg/m^3] at an altitude [m]."""
    temperature = SEA_LEVEL_TEMPERATURE - LAPSE_RATE * min(altitude, HIGHEST)
    pressure = SEA_LEVEL_PRESSURE * (temperature / SEA_LEVEL_TEMPERATURE) ** EXPONENT
    return pressure, temperature, 100.0 * pressure / (GAS_CONSTANT * temperature)


def to_body(quat: Sequence[float], vector: Sequence[float]) -> tuple[float, float, float]:
    """A vector in the body frame, from the frame that the attitude leads to."""
    (w, x, y, z), (a, b, c) = quat, vector
    # v + 2 u x (u x v + w v), with u the vector part of the conjugate
    p, q, r = w * a - (y * c - z * b), w * b - (z * a - x * c), w * c - (x * b - y * a)
    return a - 2.0 * (y * r - z * q), b - 2.0 * (z * p - x * r), c - 2.0 * (x * q - y * p)


def limited(value: float, bits: int, is_signed: bool = True) -> int:
    """A whole number that fits into bits."""
    least, most = (-(1 << bits - 1), (1 << bits - 1) - 1) if is_signed else (0, (1 << bits) - 1)
    return min(max(round(value), least), most)


class SensorSuite:
    """Sends the measurements of a vehicle.

    Args:
        mav: Encoder of messages, `pymavlink.dialects.v20.common.MAVLink`.
        field: Magnetic field, north, east, down [gauss].
        noise: Standard deviations of acceleration [m/s^2], rates [rad/s], magnetic field [gauss] and pressure [Pa].
        gps_period: Time between messages of the receiver [us].
        slow_period: Time between measurements of magnetic field and pressures [us].
    """

    def __init__(
        self, mav: Any, field: Sequence[float], noise: Sequence[float], gps_period: int, slow_period: int
    ) -> None:
        self._mav, self._field, self._noise = mav, field, noise
        self._gps_period, self._slow_period = gps_period, slow_period
        self._gps_due = self._slow_due = 0

    def send(self, now: int, state: VehicleState, draws: Sequence[float]) -> None:
        """Send what is due at a time [us]; draws: ten standard normal numbers."""
        is_slow = now >= self._slow_due
        if is_slow:
            self._slow_due = now + self._slow_period
        updated = INERTIAL | SLOW if is_slow else INERTIAL
        self._send_sensors(now, state, draws, updated)  # first: PX4 sets its clock by it
        self._send_state(now, state)
        if now >= self._gps_due:
            self._gps_due = now + self._gps_period
            self._send_gps(now, state)

    def _send_sensors(self, now: int, state: VehicleState, draws: Sequence[float], updated: int) -> None:
        """HIL_SENSOR."""
        spread = [deviation for deviation in self._noise[:3] for _ in range(3)]
        true = (*state.force, *state.rate, *to_body(state.quat, self._field))
        measured = [value + d * draw for value, d, draw in zip(true, spread, draws, strict=False)]
        altitude = state.geodetic[2]
        pressure, temperature, density = atmosphere(altitude)
        forward = to_body(state.quat, state.velocity)[0]
        dynamic = 0.5 * density * forward * abs(forward) / 100.0
        self._mav.hil_sensor_send(
            now, *measured, pressure + 0.01 * self._noise[3] * draws[9], dynamic, altitude, temperature - ZERO_CELSIUS, updated
        )  # fmt: skip

    def _send_gps(self, now: int, state: VehicleState) -> None:
        """HIL_GPS."""
        north, east, down = (100.0 * v for v in state.velocity)
        course = math.degrees(math.atan2(east, north)) % 360.0
        self._mav.hil_gps_send(
            now, FIX_3D, *_place(state), POSITION_ERROR, POSITION_ERROR, limited(math.hypot(north, east), 16, False),
            *(limited(v, 16) for v in (north, east, down)), round(100.0 * course) % 36000, N_SATELLITES, 0, UNKNOWN_YAW,
        )  # fmt: skip

    def _send_state(self, now: int, state: VehicleState) -> None:
        """HIL_STATE_QUATERNION, the true state."""
        speed = limited(100.0 * state.speed, 16, False)
        self._mav.hil_state_quaternion_send(
            now, state.quat, *state.rate, *_place(state), *(limited(100.0 * v, 16) for v in state.velocity), speed, speed,
            *(limited(a / MILLI_G, 16) for a in state.force),
        )  # fmt: skip


def _place(state: VehicleState) -> tuple[int, int, int]:
    """Latitude, longitude [1e-7 deg] and altitude [mm]."""
    latitude, longitude, altitude = state.geodetic
    return (
        round(1e7 * math.degrees(latitude)),
        round(1e7 * math.degrees(longitude)),
        limited(1e3 * altitude, 32),
    )
