"""Packets of FlightGear's multiplayer protocol, version 1.1 (https://wiki.flightgear.org/Multiplayer_protocol)."""

from __future__ import annotations

import socket
from itertools import chain, count

import numpy as np

from tussle.api import Autonomy, GroupView, Param
from tussle.errors import ParameterError
from tussle.numeric.arrays import unit
from tussle.world.geodesy import to_forward_right_down

MAGIC, PROTOCOL, POSITION = b"FGFS", 0x00010001, 7
RANGE = 100
"""Distance [nautical mile] of other players about whom a server would tell; this one does not listen."""
LAYOUT = np.dtype(
    [
        ("magic", "S4"), ("protocol", ">u4"), ("message", ">u4"), ("length", ">u4"), ("range", ">u4"), ("reply_port", ">u4"),
        ("callsign", "S8"), ("model", "S96"), ("time", ">f8"), ("lag", ">f8"), ("position", ">f8", 3),
        ("orientation", ">f4", 3), ("velocity", ">f4", 3), ("angular_velocity", ">f4", 3), ("acceleration", ">f4", 3),
        ("angular_acceleration", ">f4", 3), ("padding", ">u4"),
    ]
)  # fmt: skip
"""The header and the position message, 232 bytes; properties, which may follow, are not sent."""
MAX_CALLSIGN, MAX_MODEL = 7, 95
"""Characters; a zero follows."""


class Senders:
    """The socket of a simulation, and the callsigns of its entities.

    Attributes:
        socket: The socket.
    """

    def __init__(self) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._addresses: dict[str, str] = {}
        self._callsigns: dict[int, str] = {}
        self._taken: set[str] = set()

    def address(self, host: str) -> str:
        """The address of a host, which is looked up once.

        Raises:
            ParameterError: There is none.
        """
        if host not in self._addresses:
            try:
                self._addresses[host] = socket.gethostbyname(host)
            except (OSError, UnicodeError) as reason:
                raise ParameterError(
                    f"FlightGearMultiplayer: server_ip = {host!r} is no known host: {reason}"
                ) from None
        return self._addresses[host]

    def callsign(self, id_: int, given: str) -> bytes:
        """The callsign of an entity, which no other one has: as it is given, or with the id, else the next free number, at its end."""
        if id_ not in self._callsigns:
            numbered = (f"{given[: MAX_CALLSIGN - len(str(k))]}{k}" for k in chain([id_], count(1)))
            self._callsigns[id_] = next(each for each in chain([given], numbered) if each not in self._taken)
            self._taken.add(self._callsigns[id_])
        return self._callsigns[id_].encode()

    def end(self) -> None:
        """Close the socket; called when the simulation is closed."""
        self.socket.close()


class FlightGearMultiplayer(Autonomy):
    """Sends the entity to a FlightGear, or to a server of its multiplayer protocol, which shows it as the aircraft of another player.

    One packet per call, by UDP; FlightGear itself sends ten in a second (`rate="10"`). It expects that simulated time passes as the
    clock does. The first entity with a callsign has it as it is, the others with their id at its end, or the next number that nobody
    has. In a stack of worlds, those of the first one are sent.

    Differences from the existing system: velocities are sent, there 0; the callsign has the id, there all of a block have one; the
    lag is 0, there the time.

    Raises:
        ParameterError: The server is no known host or cannot be reached, or a text is too long.
    """

    grade = "external"

    server_ip = Param("127.0.0.1", doc="Where FlightGear or the server is.")
    server_port = Param(5000, structural=True, ge=1, le=65535, doc="Its port.")
    callsign = Param("syllo", doc="Name of the player, of at most 7 characters.")
    aircraft_model = Param(
        "Aircraft/c172p/Models/c172p.xml", doc="File of FlightGear that shows the aircraft."
    )

    def check_values(self) -> None:
        """Check the lengths of the texts."""
        for name, most in (("callsign", MAX_CALLSIGN), ("aircraft_model", MAX_MODEL)):
            value = self.values[name]
            if not (value.isascii() and value.isprintable() and 0 < len(value) <= most):
                raise ParameterError(
                    f"FlightGearMultiplayer.{name} = {value!r} is not allowed; it takes 1 to {most} characters of ASCII"
                )

    def step(self, g: GroupView) -> None:
        """Send the entities of the first world."""
        rows = np.flatnonzero(g.world == 0)
        senders: Senders = g.context.share(FlightGearMultiplayer, Senders)
        place = senders.address(self.server_ip), self.server_port
        if not len(rows):
            return
        for packet in self._packets(g, rows, senders):
            try:
                senders.socket.sendto(packet.tobytes(), place)
            except OSError as reason:
                raise ParameterError(
                    f"FlightGearMultiplayer: server_ip = {self.server_ip!r}, port {place[1]}: {reason.strerror}"
                ) from None

    def _packets(self, g: GroupView, rows: np.ndarray, senders: Senders) -> np.ndarray:
        quat, origin = g.quat[:, rows], g.scene.origin
        attitude = origin.earth_attitude(quat)
        attitude = np.where(attitude[0] < 0.0, -attitude, attitude)
        half = np.arctan2(np.sqrt((attitude[1:] * attitude[1:]).sum(axis=0)), attitude[0])
        out = np.zeros(len(rows), LAYOUT)
        out["magic"], out["protocol"], out["message"] = MAGIC, PROTOCOL, POSITION
        out["length"], out["range"] = LAYOUT.itemsize, RANGE
        out["callsign"] = [senders.callsign(int(id_), self.callsign) for id_ in g.id[rows]]
        out["model"], out["time"] = self.aircraft_model.encode(), g.t[rows]
        out["position"] = origin.to_earth_centred(g.pos[:, rows]).T
        out["orientation"] = (2.0 * half * unit(attitude[1:])).T
        out["velocity"] = to_forward_right_down(quat, g.vel[:, rows]).T
        out["angular_velocity"] = to_forward_right_down(quat, g.omega[:, rows]).T
        return out
