"""Hovers a multirotor of tussle in the place of PX4's flight controller, with MAVLink by TCP.

    python px4_peer.py 4560 30        # the simulator listens at port 4560; hover 30 m above the start

It estimates the state from the gyroscope, the magnetometer, the barometer and the receiver of satellite navigation. It ends with the
connection. It needs no package, and nothing of tussle. MAVLink is that of https://mavlink.io/en/guide/serialization.html, the messages
those of https://mavlink.io/en/messages/common.html.
"""

from __future__ import annotations

import argparse
import math
import socket
import struct
import time

from quadrotor import GRAVITY, hover

HEARTBEAT, HIL_CONTROLS, HIL_SENSOR, HIL_GPS, HIL_STATE = 0, 93, 107, 113, 115
CRC_EXTRA = {HEARTBEAT: 50, HIL_CONTROLS: 47, HIL_SENSOR: 108, HIL_GPS: 124, HIL_STATE: 4}
SENSOR, GPS = struct.Struct("<Q13fIB"), struct.Struct("<QiiiHHHhhhHBBBH")
CONTROLS = struct.Struct("<QQ16fB")
FASTEST = 1200.0  # rotor speed of the control 1 [rad/s]
ARMED, CUSTOM, LOCKSTEP = 128, 1, 1
DECLINATION = math.atan2(0.0077, 0.215)  # of the magnetic field that tussle simulates unless told otherwise
EARTH_RADIUS = 6371000.0


def checksum(data):
    """CRC-16/MCRF4XX."""
    crc = 0xFFFF
    for byte in data:
        x = (byte ^ crc) & 0xFF
        x ^= (x << 4) & 0xFF
        crc = (crc >> 8) ^ (x << 8) ^ (x << 3) ^ (x >> 4)
    return crc & 0xFFFF


def packet(number, sequence, payload):
    """A message of MAVLink 2."""
    payload = payload.rstrip(b"\0") or b"\0"
    head = struct.pack("<BBBBBB", len(payload), 0, 0, sequence & 0xFF, 1, 1) + number.to_bytes(3, "little")
    crc = checksum(head + payload + bytes([CRC_EXTRA[number]]))
    return b"\xfd" + head + payload + struct.pack("<H", crc)


def take_messages(received):
    """Remove the complete messages from the bytes that were received, and return them: (number, payload)."""
    found = []
    while len(received) >= 12 and len(received) >= 12 + received[1]:
        assert received[0] == 0xFD, "not MAVLink 2"
        length, number = received[1], int.from_bytes(received[7:10], "little")
        body, crc = bytes(received[1 : 10 + length]), struct.unpack_from("<H", received, 10 + length)[0]
        if number in CRC_EXTRA:
            assert checksum(body + bytes([CRC_EXTRA[number]])) == crc, f"checksum of message {number}"
            found.append((number, body[9:]))
        del received[: 12 + length]
    return found


class Estimator:
    """The state of the vehicle from its sensors."""

    def __init__(self):
        self.time = self.home = None
        self.euler = [0.0, 0.0, 0.0]
        self.rate = (0.0, 0.0, 0.0)
        self.offset, self.velocity = [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]
        self.pressure = None

    def take_sensor(self, payload):
        """HIL_SENSOR. Returns its time [us]."""
        time_us, *values = SENSOR.unpack(payload.ljust(SENSOR.size, b"\0"))
        acceleration, self.rate, field, (pressure, _, _, _), updated = (
            values[:3], values[3:6], values[6:9], values[9:13], values[13],
        )  # fmt: skip
        if self.time is None:
            assert updated & 0x1FC0 == 0x1FC0, "the first message has all sensors"
            self.euler[2] = DECLINATION - math.atan2(field[1], field[0])
        else:
            self.integrate((time_us - self.time) * 1e-6, acceleration)
        self.time = time_us
        if updated & 0x200:
            # Height above the place of the first measurement, by the barometric formula of a standard atmosphere.
            self.pressure = self.pressure or pressure
            height = (
                288.15 / 0.0065 * ((self.pressure / 1013.25) ** 0.190263 - (pressure / 1013.25) ** 0.190263)
            )
            self.offset[2] += 0.05 * (-height - self.offset[2])
        return time_us

    def integrate(self, dt, acceleration):
        """Move the estimate by dt [s] with the measured rates and specific force."""
        (roll, pitch, _), (p, q, r) = self.euler, self.rate
        turn = q * math.sin(roll) + r * math.cos(roll)
        self.euler[0] += dt * (p + math.tan(pitch) * turn)
        self.euler[1] += dt * (q * math.cos(roll) - r * math.sin(roll))
        self.euler[2] += dt * turn / math.cos(pitch)
        ax, ay, az = acceleration
        down = -math.sin(pitch) * ax + math.cos(pitch) * (math.sin(roll) * ay + math.cos(roll) * az) + GRAVITY
        self.velocity[2] += dt * down
        for i in range(3):
            self.offset[i] += dt * self.velocity[i]

    def take_gps(self, payload):
        """HIL_GPS."""
        _, lat, lon, _, _, _, _, *velocity, _, fix, _, _, _ = GPS.unpack(payload.ljust(GPS.size, b"\0"))
        assert fix == 3, "no fix"
        self.home = self.home or (lat, lon)
        north = math.radians((lat - self.home[0]) * 1e-7) * EARTH_RADIUS
        east = math.radians((lon - self.home[1]) * 1e-7) * EARTH_RADIUS * math.cos(math.radians(lat * 1e-7))
        self.offset[:2] = north, east
        self.velocity[:2] = velocity[0] * 0.01, velocity[1] * 0.01
        self.velocity[2] += 0.3 * (velocity[2] * 0.01 - self.velocity[2])


def connected(port, patience):
    """A connection with the simulator, as soon as it listens."""
    limit = time.monotonic() + patience
    while True:
        try:
            return socket.create_connection(("127.0.0.1", port))
        except ConnectionRefusedError:
            if time.monotonic() > limit:
                raise
            time.sleep(0.05)


def main():
    """Hover until the connection ends."""
    parser = argparse.ArgumentParser()
    parser.add_argument("port", type=int)
    parser.add_argument("climb", type=float)
    parser.add_argument("--patience", type=float, default=60.0, help="longest wait for the simulator [s]")
    asked = parser.parse_args()
    print("ready", flush=True)
    connection = connected(asked.port, asked.patience)
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    connection.sendall(packet(HEARTBEAT, 0, struct.pack("<IBBBBB", 0, 2, 12, 0, 0, 3)))
    estimate, received, sequence, heading = Estimator(), bytearray(), 0, None
    while data := connection.recv(65536):
        received += data
        for number, payload in take_messages(received):
            if number == HIL_GPS:
                estimate.take_gps(payload)
            elif number == HIL_SENSOR:
                time_us = estimate.take_sensor(payload)
                heading = estimate.euler[2] if heading is None else heading
                offset = [*estimate.offset[:2], estimate.offset[2] + asked.climb]
                speeds = hover(offset, estimate.velocity, estimate.euler, estimate.rate, heading)
                controls = [speed / FASTEST for speed in speeds] + [0.0] * 12
                sequence += 1
                answer = CONTROLS.pack(time_us, LOCKSTEP, *controls, ARMED | CUSTOM)
                connection.sendall(packet(HIL_CONTROLS, sequence, answer))
    seconds = (estimate.time or 0) * 1e-6
    print(f"after {seconds:.2f} s: {-estimate.offset[2]:.2f} m above the start, as estimated", flush=True)


if __name__ == "__main__":
    main()
