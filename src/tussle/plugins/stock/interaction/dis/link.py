"""The socket of a simulation in a DIS exercise, and what other simulators have sent."""

from __future__ import annotations

import ipaddress
import math
import socket
from dataclasses import dataclass

import numpy as np

from tussle.errors import ParameterError, PortError
from tussle.pacing import Pace
from tussle.plugins.links.ports import opening
from tussle.plugins.stock.interaction.dis import pdu
from tussle.world.geodesy import Origin

MAX_DATAGRAMS = 20_000
"""Read at once; with more, a flood would hold the simulation up."""
RECEIVE_BUFFER = 4 * 1024 * 1024  # [byte] the system may give less
BROADCAST = ".255"
MAX_BYTES = 65536
MAX_SPEED, MAX_RATE = 1e5, 1e3
"""Largest component of a velocity [m/s] or acceleration [m/s^2], and of an angular velocity [rad/s], that is believed."""
RATE_FIELDS = {"velocity": MAX_SPEED, "acceleration": MAX_SPEED, "angular_velocity": MAX_RATE}


@dataclass
class Remote:
    """An entity of another simulator.

    Attributes:
        record: Its last PDU.
        t: When that came [s], simulated time.
        is_here: Whether it has become an entity of this world.
    """

    record: np.ndarray
    t: float
    is_here: bool = False


class ExerciseLink:
    """A UDP socket, the remote entities, and what was sent last.

    Args:
        address: Where PDUs are sent: a host, a broadcast or a multicast address.
        port: Its port.
        listen_address: Address on which PDUs are received: an own one, a broadcast address, or with multicast that of the interface.
        listen_port: Port on which they are received; 0 for none.
        warp: Simulated seconds per second of its pace.

    Attributes:
        remotes: Number of site, application and entity, as one -> entity of another simulator, in order of arrival.
        sent: Id of an entity of this world -> its last PDU.
        stamp: Timestamp of PDUs of this step.
        pace: Its clock.
        n_sent: PDUs sent; n_received and n_refused likewise.

    Raises:
        ParameterError: An address is not known.
        PortError: The port is taken.
    """

    def __init__(self, address: str, port: int, listen_address: str, listen_port: int, warp: float) -> None:
        self.remotes: dict[int, Remote] = {}
        self.sent: dict[int, tuple[np.ndarray, float]] = {}
        self.n_sent = self.n_received = self.n_refused = 0
        self.stamp, self.pace, self._t = 0, Pace(warp), -math.inf
        self._listens = bool(listen_port)
        self._place = (_resolved("address", address), port)
        own = _resolved("listen_address", listen_address)
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.settimeout(None)  # rospy sets a default, with which MSG_DONTWAIT waits
        try:
            with opening("listen_port", listen_address, listen_port):
                self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
                if group := ipaddress.ip_address(self._place[0]).is_multicast:
                    self.socket.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(own))
                if self._listens:
                    self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER)
                    if group or own.endswith(BROADCAST):  # a port that all simulators of a machine share
                        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
                    if group:
                        member = socket.inet_aton(self._place[0]) + socket.inet_aton(own)
                        self.socket.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, member)
                    self.socket.bind((self._place[0] if group else own, listen_port))
        except PortError:
            self.socket.close()
            raise

    def begin(self, t: float) -> None:
        """Begin a step that ends at time t [s]. When that is before the last one, after a reset, all remote entities come anew."""
        if t < self._t:
            for remote in self.remotes.values():
                remote.t, remote.is_here = min(remote.t, t), False
        self._t, self.stamp = t, pdu.timestamp(t)

    def receive(self, t: float, exercise: int, own: int, origin: Origin, reach: float, most: int) -> None:
        """Take what has come until time t [s].

        Args:
            t: Simulated time.
            exercise: Number of the exercise.
            own: Site and application of this simulation, as one number, whose PDUs are passed over.
            origin: Where the world frame is.
            reach: Largest distance of an entity from the origin [m].
            most: Largest number of remote entities.
        """
        found: list[bytes] = []
        for _ in range(MAX_DATAGRAMS if self._listens else 0):
            try:
                datagram = self.socket.recv(MAX_BYTES, socket.MSG_DONTWAIT)
            except BlockingIOError:
                break
            pdus, n_refused = pdu.split(datagram, exercise)
            found += pdus
            self.n_refused += n_refused
        if not found:
            return
        records = pdu.decode(found)
        keys = (
            records["site"].astype(np.int64) << 32
            | records["application"].astype(np.int64) << 16
            | records["entity"]
        )
        foreign = keys >> 16 != own
        sound = _is_sound(records, origin, reach)
        is_gone = (records["appearance"] & pdu.DEACTIVATED) != 0
        for key, record, is_kept, leaves in zip(
            keys[foreign].tolist(), records[foreign], sound[foreign], is_gone[foreign], strict=True
        ):
            if not is_kept or (key not in self.remotes and len(self.remotes) >= most):
                self.n_refused += 1
                continue
            self.n_received += 1
            if leaves:
                self.remotes.pop(key, None)
            elif key in self.remotes:
                self.remotes[key].record, self.remotes[key].t = record, t
            else:
                self.remotes[key] = Remote(record, t)

    def forget(self, before: float) -> None:
        """Drop the remote entities of which nothing has come since a time [s]."""
        for key in [key for key, remote in self.remotes.items() if remote.t < before]:
            del self.remotes[key]

    def send(self, records: np.ndarray) -> None:
        """Send PDUs, each as a datagram.

        Raises:
            ParameterError: The address cannot be reached.
        """
        for record in records:
            try:
                self.socket.sendto(record.tobytes(), self._place)
            except OSError as reason:
                place, port = self._place
                raise ParameterError(f"DIS: address = {place!r}, port {port}: {reason.strerror}") from None
            self.sent[int(record["entity"])] = record, self._t
        self.n_sent += len(records)

    def leave(self, numbers: list[int]) -> None:
        """Tell the others that entities with these numbers are gone, at the places where they take them to be now."""
        if not numbers:
            return
        records, times = zip(*(self.sent[number] for number in numbers), strict=True)
        gone = pdu.moved_on(np.array(list(records), pdu.LAYOUT), self._t - np.array(times))
        gone["appearance"] |= pdu.DEACTIVATED
        gone["timestamp"] = self.stamp
        self.send(gone)
        for number in numbers:
            del self.sent[number]

    def end(self) -> None:
        """Say that all entities are gone, and close the socket; called when the simulation is closed."""
        try:
            self.leave(list(self.sent))
        except ParameterError:  # nobody is left to be told
            self.sent.clear()
        finally:
            self.socket.close()


def _resolved(name: str, host: str) -> str:
    try:
        return socket.gethostbyname(host)
    except (OSError, UnicodeError) as reason:
        raise ParameterError(f"DIS: {name} = {host!r} is no known host: {reason}") from None


def _is_sound(records: np.ndarray, origin: Origin, reach: float) -> np.ndarray:
    """Whether each PDU, (n,), has finite numbers of a possible size and a location within reach [m] of the origin."""
    with np.errstate(invalid="ignore", over="ignore"):
        sound = np.isfinite(records["orientation"]).all(axis=1) & (
            np.abs(records["orientation"]) < MAX_RATE
        ).all(axis=1)
        for name, most in RATE_FIELDS.items():
            sound &= (np.abs(records[name]) < most).all(axis=1)
        offset = records["location"].astype(float) - np.array(origin.earth_centred)
        return np.asarray(sound & ((offset * offset).sum(axis=1) < reach * reach))
