"""Hovers a multirotor of tussle in the place of ArduPilot's flight controller, with its packets.

    python ardupilot_peer.py json 9002 30             # the simulator takes servo frames at port 9002; hover 30 m above the start
    python ardupilot_peer.py scrimmage 5003 5002 30   # states come to port 5003, servo packets go to port 5002

It ends when no state has come for some seconds after the first one (--patience). It needs no package, and nothing of tussle. The packets
are those of ArduPilot's libraries/SITL/examples/JSON/readme.md and of its model scrimmage.
"""

from __future__ import annotations

import argparse
import json
import math
import socket
import struct
import time

from quadrotor import hover

MAGIC, RATE = 18458, 100
EARTH_RADIUS = 6371000.0
LOWEST, HIGHEST = 346.41, 1200.0  # rotor speeds of the pulses of 1000 and 2000 us [rad/s]
RESEND = 1.0  # [s]


def pulses(speeds):
    """Pulse widths of sixteen outputs [us]; the four rotors are the first ones."""
    used = [round(1000.0 + 1000.0 * (w - LOWEST) / (HIGHEST - LOWEST)) for w in speeds]
    return used + [0] * (16 - len(used))


def euler_of(w, x, y, z):
    """Roll, pitch, yaw of a quaternion."""
    return (
        math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)),
        math.asin(max(-1.0, min(1.0, 2.0 * (w * y - z * x)))),
        math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)),
    )


class JsonPeer:
    """The protocol of ArduPilot's model JSON."""

    def __init__(self, port, to_port):
        self.to, self.count = ("127.0.0.1", port), 0
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.sent = b""

    def send(self, widths):
        """Send a frame."""
        self.count += 1
        self.sent = struct.pack("<HHI16H", MAGIC, RATE, self.count, *widths)
        self.resend()

    def resend(self):
        """Send the last frame again."""
        self.socket.sendto(self.sent, self.to)

    def read(self, data):
        """Time, position, velocity, roll, pitch, yaw, and rates of a packet."""
        state = json.loads(data)
        return (
            state["timestamp"], state["position"], state["velocity"], euler_of(*state["quaternion"]), state["imu"]["gyro"],
        )  # fmt: skip


class ScrimmagePeer:
    """The protocol of ArduPilot's model scrimmage. Nothing is sent again."""

    def __init__(self, port, to_port):
        self.to, self.home = ("127.0.0.1", to_port), None
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", port))

    def send(self, widths):
        """Send servo pulses."""
        self.socket.sendto(struct.pack("<16H", *widths), self.to)

    def resend(self):
        """Send nothing, as ArduPilot does."""

    def read(self, data):
        """Time, position, velocity, roll, pitch, yaw, and rates of a packet."""
        time_us, *values = struct.unpack("<Q17d", data)
        latitude, longitude, altitude = values[:3]
        self.home = self.home or (latitude, longitude, altitude)
        north = math.radians(latitude - self.home[0]) * EARTH_RADIUS
        east = math.radians(longitude - self.home[1]) * EARTH_RADIUS * math.cos(math.radians(latitude))
        return (
            time_us * 1e-6,
            (north, east, self.home[2] - altitude),
            values[4:7],
            values[13:16],
            values[10:13],
        )


def main():
    """Hover until the simulator is silent."""
    parser = argparse.ArgumentParser()
    parser.add_argument("protocol", choices=("json", "scrimmage"))
    parser.add_argument("ports", type=int, nargs="+", help="ports, and the climb [m]")
    parser.add_argument("--patience", type=float, default=10.0, help="longest wait for the next state [s]")
    asked = parser.parse_args()
    *ports, climb = asked.ports
    peer = (JsonPeer if asked.protocol == "json" else ScrimmagePeer)(ports[0], ports[-1])
    peer.socket.settimeout(RESEND)
    peer.send(pulses([LOWEST] * 4))
    print("ready", flush=True)
    start, heard, t, height = None, math.inf, 0.0, 0.0
    while time.monotonic() - heard < asked.patience:
        try:
            data = peer.socket.recv(4096)
        except TimeoutError:
            peer.resend()
            continue
        heard = time.monotonic()
        t, position, velocity, euler, rate = peer.read(data)
        start = start or (*position[:2], position[2] - climb, euler[2])
        offset = [a - b for a, b in zip(position, start[:3], strict=True)]
        height = climb - offset[2]
        peer.send(pulses(hover(offset, velocity, euler, rate, start[3])))
    print(f"at {t:.2f} s: {height:.2f} m above the start", flush=True)


if __name__ == "__main__":
    main()
