"""A connection with PX4: MAVLink by TCP (https://docs.px4.io/main/en/simulation/, Simulator MAVLink API)."""

from __future__ import annotations

import math
import socket
import time
import warnings
from bisect import bisect_right
from collections.abc import Callable, Sequence
from typing import Any

from tussle.declare import texts
from tussle.plugins.links.autopilots.frames import VehicleState
from tussle.plugins.links.autopilots.link import AutopilotLink, bound

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


MAX_BYTES = 1 << 20
"""Largest number of bytes read in one step, and of unsent bytes before the autopilot counts as stuck."""
SEND_BUFFER = 1 << 16
"""Size of the system's send buffer [B]."""
FREEWHEEL_STEP = 4000
"""PX4's time between two messages while it starts [us]: its usual 250 Hz."""
LOCKSTEP_FLAG = 1
"""HIL_ACTUATOR_CONTROLS_FLAGS_LOCKSTEP."""
COMPONENT = 1
"""MAV_COMP_ID_AUTOPILOT1."""


class Px4Link(AutopilotLink):
    """A connection with PX4, which connects to tussle. A second one is refused: nobody listens any more.

    PX4's time begins with its first message. Until PX4 sends its first controls, the vehicle stands still, and PX4 gets the same
    measurements with the times of a clock of `FREEWHEEL_STEP`, so that it can start.

    PX4 need not answer all measurements, since the rate of its controllers is limited. In lockstep, the step of one that has no answer
    after `patience` goes on with the controls before. From then on only every n-th step waits, where n is the number of measurements from
    one that was answered to the next.

    Args:
        listen: Address to listen at.
        port: Port to listen at.
        lockstep: Whether PX4 answers each message of its sensors.
        timeout: Longest silence [s].
        patience: Longest wait for the answer to one message [s].
        system: Number of the system from which messages come.
        freewheel_period: Time between the messages while PX4 starts [s].
        make_suite: Makes the sensors, from an encoder of messages.
        dialect: The module `pymavlink.dialects.v20.common`.
        release: Called after the connection has been closed.
    """

    def __init__(
        self,
        listen: str,
        port: int,
        lockstep: bool,
        timeout: float,
        patience: float,
        system: int,
        freewheel_period: float,
        make_suite: Callable[[Any], SensorSuite],
        dialect: Any,
        release: Callable[[], object],
    ) -> None:
        super().__init__(f"PX4 at port {port}", lockstep, timeout, release)
        self._port, self._freewheel_period, self._patience = port, freewheel_period, patience
        self._socket = bound(socket.SOCK_STREAM, listen, port, "port")
        self._socket.listen(1)
        self._is_connected = self._has_controls = self._has_told = False
        self._unsent, self._n_read = bytearray(), 0
        self._mav = dialect.MAVLink(self, system, COMPONENT)
        self._mav.robust_parsing = True
        self._suite = make_suite(self._mav)
        self._state: VehicleState | None = None
        self._draws: Sequence[float] = ()
        self._now = self._offset = self._n_freewheel = 0
        self._freewheel_due = self._sent_at = self._waited = 0.0
        self._open: list[int] = []  # times of the measurements after the last one that was answered [us]
        self._every = 1  # measurements for one answer

    def write(self, data: bytes) -> None:
        """Send bytes; called by the encoder."""
        self._unsent += data

    def sockets(self) -> list[socket.socket]:
        """The open socket."""
        return [self._socket]

    def begin(self, state: VehicleState, draws: Sequence[float] = ()) -> None:
        """Send the measurements, or wait for PX4."""
        self._state, self._draws, self._n_read = state, draws, 0
        self.is_done, had_controls = False, self._has_controls
        self.receive()
        if had_controls:
            self._send_step()

    def receive(self) -> None:
        """Take the connection, and read all messages."""
        if not self._is_connected:
            self._accept()
        while self._is_connected and not self.failure:
            try:
                data = self._socket.recv(65536)
            except BlockingIOError:
                return
            except OSError as error:
                self.fail(error.strerror or str(error))
                return
            if not data:
                self.fail("the connection was closed")
                return
            self._n_read += len(data)
            if self._n_read > MAX_BYTES:
                self.fail(f"more than {MAX_BYTES} bytes in one step")
                return
            for message in self._mav.parse_buffer(data) or ():
                self._take(message)

    def tick(self, now: float) -> None:
        """Let PX4 start, and send what could not be sent."""
        if self._is_connected and not self._has_controls and now >= self._freewheel_due:
            self._freewheel_due = now + self._freewheel_period
            self._n_freewheel += 1
            self._now += FREEWHEEL_STEP
            # PX4 takes a sensor for broken that measures the same again and again.
            sign = 1.0 if self._n_freewheel % 2 else -1.0
            self._send_sensors([sign * draw for draw in self._draws])
        elif self._has_controls and not self.is_done and now - self._sent_at >= self._patience:
            self._go_on()
        self._flush()

    def _go_on(self) -> None:
        """End the step with the controls before."""
        assert self._state is not None
        self._waited += self._patience
        if self._waited >= self.timeout:
            self.fail(f"{self.missing()} within {self.timeout:g} s")
            return
        if not self._has_told:
            self._has_told = True
            text = (
                f"{self.autopilot}: no HIL_ACTUATOR_CONTROLS within {self._patience:g} s for the measurements of t = {self._state.t:g} s; "
                "steps without an answer go on with the controls before, and `unanswered` counts them"
            )
            warnings.warn(text, RuntimeWarning, stacklevel=2)
        self.is_unanswered = self.is_done = True

    def missing(self) -> str:
        """What has not come."""
        if not self._is_connected:
            return "no connection"
        return "no HIL_ACTUATOR_CONTROLS"

    def _accept(self) -> None:
        try:
            connection, place = self._socket.accept()
        except BlockingIOError:
            return
        except OSError as error:
            self.fail(error.strerror or str(error))
            return
        self._socket.close()
        self._socket, self._is_connected = connection, True
        connection.setblocking(False)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER)
        self.autopilot = f"PX4 at {place[0]}:{place[1]}, port {self._port}"

    def _take(self, message: Any) -> None:
        """Take a message; only controls matter."""
        kind = message.get_type()
        if kind == "BAD_DATA":
            self.fail(f"this is not MAVLink: {texts.shown(bytes(message.data).decode('latin-1'))}")
        elif kind == "HIL_ACTUATOR_CONTROLS":
            # PX4 stamps its answer with the time of the measurements. While PX4 starts, any will do: it may be slower than they come.
            is_stamped = bool(message.flags & LOCKSTEP_FLAG) and self.lockstep and self._has_controls
            answered = bisect_right(self._open, message.time_usec) if is_stamped else len(self._open)
            if is_stamped and not answered:  # it is older than the controls that there are
                return
            if any(map(math.isinf, message.controls)):
                self.fail("HIL_ACTUATOR_CONTROLS has infinite numbers")
                return
            self.hear()
            self._waited = 0.0
            self.commands = {k: x for k, x in enumerate(message.controls) if not math.isnan(x)}
            if self._has_controls:
                del self._open[:answered]
                self._every = max(answered, 1)
                self.is_done = self.is_done or not self._open
            else:
                self._start()

    def _start(self) -> None:
        """Begin to fly: the time of the measurements goes on from that of the start."""
        assert self._state is not None
        self._has_controls = True
        self._offset = self._now + FREEWHEEL_STEP - round(1e6 * self._state.t)
        self._send_step()

    def _send_step(self) -> None:
        """Send the measurements of this step, and wait for an answer if one is due."""
        assert self._state is not None
        self._now, self._sent_at = self._offset + round(1e6 * self._state.t), time.monotonic()
        self._send_sensors(self._draws)
        self._flush()
        self._open.append(self._now)
        is_due = len(self._open) >= self._every
        self.is_done = not (self.lockstep and is_due)
        self.is_unanswered = self.lockstep and not is_due

    def _send_sensors(self, draws: Sequence[float]) -> None:
        assert self._state is not None
        self._suite.send(self._now, self._state, draws)

    def _flush(self) -> None:
        """Send what is not sent yet, as far as it goes."""
        while self._unsent and not self.failure:
            try:
                n = self._socket.send(self._unsent)
            except BlockingIOError:
                if len(self._unsent) > MAX_BYTES:
                    self.fail("it does not read what is sent")
                return
            except OSError as error:
                self.fail(f"nothing can be sent: {error.strerror or error}")
                return
            del self._unsent[:n]
