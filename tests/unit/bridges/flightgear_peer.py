"""A FlightGear that listens for other players: prints the fields of n packets as JSON, decoded one by one as in RFC 4506 (XDR).

The order of the fields is that of the page Multiplayer protocol of FlightGear's wiki. Nothing of tussle is used.
"""

import json
import math
import socket
import struct
import sys


class Reader:
    def __init__(self, data):
        self.data, self.at = data, 0

    def take(self, format_):
        values = struct.unpack_from(">" + format_, self.data, self.at)
        self.at += struct.calcsize(">" + format_)
        return values if len(values) > 1 else values[0]

    def text(self, n):
        return self.take(f"{n}s").split(b"\0")[0].decode()


def geodetic(x, y, z):
    """Latitude and longitude [deg] and height [m] on WGS84, by iteration."""
    a, e2 = 6378137.0, 6.69437999014e-3
    p, latitude, height = math.hypot(x, y), math.atan2(z, math.hypot(x, y)), 0.0
    for _ in range(50):
        n = a / math.sqrt(1 - e2 * math.sin(latitude) ** 2)
        height = p / math.cos(latitude) - n
        latitude = math.atan2(z, p * (1 - e2 * n / (n + height)))
    return [math.degrees(latitude), math.degrees(math.atan2(y, x)), height]


def rotated(axis, v):
    """A vector turned about an axis by the axis's length (Rodrigues)."""
    angle = math.sqrt(sum(x * x for x in axis)) or 1e-300
    k = [x / angle for x in axis]
    cross = [k[1] * v[2] - k[2] * v[1], k[2] * v[0] - k[0] * v[2], k[0] * v[1] - k[1] * v[0]]
    dot = sum(p * q for p, q in zip(k, v, strict=True))
    return [
        v[i] * math.cos(angle) + cross[i] * math.sin(angle) + k[i] * dot * (1 - math.cos(angle))
        for i in range(3)
    ]


def local(latitude, longitude, v):
    """A vector of Earth-centred axes as north, east, down."""
    b, l = math.radians(latitude), math.radians(longitude)
    axes = (
        (-math.sin(b) * math.cos(l), -math.sin(b) * math.sin(l), math.cos(b)),
        (-math.sin(l), math.cos(l), 0.0),
        (-math.cos(b) * math.cos(l), -math.cos(b) * math.sin(l), -math.sin(b)),
    )
    return [sum(p * q for p, q in zip(axis, v, strict=True)) for axis in axes]


def decoded(data):
    r = Reader(data)
    out = {
        "bytes": len(data),
        "magic": r.take("I"),
        "version": r.take("I"),
        "message": r.take("I"),
        "length": r.take("I"),
    }
    out |= {"range": r.take("I"), "port": r.take("I"), "callsign": r.text(8), "model": r.text(96)}
    out |= {"time": r.take("d"), "lag": r.take("d")}
    where = geodetic(*r.take("3d"))
    turn = r.take("3f")
    velocity, omega, *accelerations = (r.take("3f") for _ in range(4))
    out |= {"where": where, "accelerations": accelerations, "padding": r.take("I"), "rest": len(data) - r.at}
    out |= {
        name: local(*where[:2], rotated(turn, v))
        for name, v in {
            "forward": (1.0, 0.0, 0.0),
            "right": (0.0, 1.0, 0.0),
            "velocity": velocity,
            "omega": omega,
        }.items()
    }
    return out


ear = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
ear.bind(("127.0.0.1", 0))
print(ear.getsockname()[1], flush=True)
print(json.dumps([decoded(ear.recv(1200)) for _ in range(int(sys.argv[1]))]), flush=True)
