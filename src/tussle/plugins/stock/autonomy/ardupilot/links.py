"""Connections with ArduPilot, by UDP."""

from __future__ import annotations

import errno
import os
import socket
import time
from abc import abstractmethod
from collections.abc import Callable, Sequence

from tussle.plugins.links.autopilots.frames import VehicleState
from tussle.plugins.links.autopilots.link import AutopilotLink, bound
from tussle.plugins.stock.autonomy.ardupilot import wire

MAX_PACKETS = 1000
"""Packets in one step, refused ones included, beyond which nothing more is read: the buffer of a socket holds some hundreds."""
MAX_PACKET = 2048
"""Size of the receive buffer [B], larger than any packet."""
UNHEARD_PERIOD = 0.1
"""Time after which a state that nobody listened to is sent again [s]."""


class UdpLink(AutopilotLink):
    """A connection by UDP; abstract.

    Args:
        autopilot: Name and place of the autopilot, for errors.
        socket_: Where servo packets come.
        lockstep: Whether each state is answered.
        timeout: Longest wait for an answer [s].
        resend_period: Time after which a state that has no answer is sent again [s].
        may_restart: Whether it goes on with an autopilot that has started anew.
        release: Called after the connection has been closed.
    """

    def __init__(
        self,
        autopilot: str,
        socket_: socket.socket,
        lockstep: bool,
        timeout: float,
        resend_period: float,
        may_restart: bool,
        release: Callable[[], object],
    ) -> None:
        super().__init__(autopilot, lockstep, timeout, release)
        self._may_restart = may_restart
        self._former: set[tuple[str, int]] = set()
        self._in, self._resend_period = socket_, resend_period
        self._state, self._sent = b"", 0.0
        self._peer: tuple[str, int] | None = None
        self._refused, self._n_packets = "", 0
        self._is_unheard = False

    def sockets(self) -> list[socket.socket]:
        """The open sockets."""
        return [self._in]

    def receive(self) -> None:
        """Read all packets."""
        while not self.failure:
            try:
                data, place = self._in.recvfrom(MAX_PACKET)
            except BlockingIOError:
                return
            except OSError as error:
                self.fail(f"nothing can be received: {error.strerror}")
                return
            self._n_packets += 1
            if self._n_packets > MAX_PACKETS:
                self.fail(
                    f"more than {MAX_PACKETS} packets in one step, the last from {_at(place)}{self._remark()}"
                )
            elif self._is_stranger(place):
                self._refused = f"a packet from {_at(place)}"
            else:
                self._read(data, place)

    def _read(self, data: bytes, place: tuple[str, int]) -> None:
        """Take a packet, if it is one of the protocol."""
        try:
            frame = self._decode(data)
        except ValueError as error:
            self._refused = f"{error}, from {_at(place)}"
            return
        if self._peer is None:
            self._peer = place
        elif place != self._peer and self._has_replaced(frame, place):
            self._former.add(self._peer)
            self._peer = place
            self._restart(frame)
            return
        elif place != self._peer:
            self.fail(
                f"a second autopilot, at {_at(place)}, sends to the port of the one at {_at(self._peer)}"
            )
            return
        self.hear()
        self._take(frame)

    def tick(self, now: float) -> None:
        """Send the state again."""
        if self.lockstep and self._sent and not self.is_done and now - self._sent >= self._resend_period:
            self._send()

    def missing(self) -> str:
        """What has not come."""
        return f"no servo packet{self._remark()}"

    def _remark(self) -> str:
        return f" ({self._refused} was refused)" if self._refused else ""

    def _send(self) -> None:
        """Send the state."""
        self._sent = time.monotonic()
        try:
            self._send_state(self._state)
        except BlockingIOError:  # the buffer is full: it is sent again
            pass
        except ConnectionRefusedError:  # of the packet before
            self._is_unheard = True
        except OSError as error:
            self.fail(f"nothing can be sent: {error.strerror}")

    def _has_replaced(self, frame: wire.ServoFrame, place: tuple[str, int]) -> bool:
        """Whether a packet from another place is of an autopilot that has started anew, with which the vehicle goes on."""
        return self._may_restart and place not in self._former

    def _restart(self, frame: wire.ServoFrame) -> None:
        """Go on with an autopilot that has started anew: its vehicle has no commands until a state is answered."""
        self.hear()
        self.commands, self.has_restarted, self.is_done = {}, True, True

    @abstractmethod
    def _is_stranger(self, place: tuple[str, int]) -> bool:
        """Whether packets from a place are refused."""

    @abstractmethod
    def _decode(self, data: bytes) -> wire.ServoFrame:
        """Decode a packet."""

    @abstractmethod
    def _take(self, frame: wire.ServoFrame) -> None:
        """Take a frame of the autopilot."""

    @abstractmethod
    def _send_state(self, data: bytes) -> None:
        """Send bytes to the autopilot."""


class ScrimmageLink(UdpLink):
    """The protocol "scrimmage": states go to a port of ArduPilot, servo packets come to one of tussle.

    Servo packets have no number, so what came before a state was sent is no answer to it.
    """

    def __init__(
        self,
        address: str,
        to_port: int,
        from_port: int,
        listen: str,
        lockstep: bool,
        timeout: float,
        resend_period: float,
        may_restart: bool,
        release: Callable[[], object],
    ) -> None:
        received = bound(socket.SOCK_DGRAM, listen, from_port, "from_ardupilot_port")
        where = f"ArduPilot at {address}:{to_port}, servo packets at port {from_port}"
        super().__init__(where, received, lockstep, timeout, resend_period, may_restart, release)
        self._address = address
        self._out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._out.setblocking(False)
        try:
            self._out.connect((address, to_port))
        except OSError as error:
            self.fail(f"no way there: {error.strerror}")

    def sockets(self) -> list[socket.socket]:
        """The open sockets."""
        return [self._in, self._out]

    def begin(self, state: VehicleState, draws: Sequence[float] = ()) -> None:
        """Send the state."""
        self._n_packets = 0
        self.receive()
        # One that has started anew gets the state only when its vehicle has been put back.
        self.is_done = self.has_restarted or not self.lockstep
        self._state = wire.encode_state(state)
        if not self.has_restarted:
            self._send()

    def receive(self) -> None:
        """Read all packets, and whether nobody listens to the states."""
        super().receive()
        refused = self._out.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
        self._is_unheard |= refused == errno.ECONNREFUSED
        if refused and not self._is_unheard:
            self.fail(f"nothing can be sent: {os.strerror(refused)}")

    def tick(self, now: float) -> None:
        """Send the state again, soon if nobody listened."""
        if self._is_unheard and not self.is_done and now - self._sent >= UNHEARD_PERIOD:
            self._is_unheard = False
            self._send()
        super().tick(now)

    def missing(self) -> str:
        """What has not come."""
        return f"no servo packet at port {self._in.getsockname()[1]}{self._remark()}"

    def _is_stranger(self, place: tuple[str, int]) -> bool:
        return place[0] != self._address

    def _decode(self, data: bytes) -> wire.ServoFrame:
        return wire.decode_servos(data)

    def _take(self, frame: wire.ServoFrame) -> None:
        self.commands = frame.pulses
        self.is_done = True

    def _send_state(self, data: bytes) -> None:
        self._out.send(data)


class JsonLink(UdpLink):
    """The protocol "json": ArduPilot sends numbered frames to a port of tussle, and gets states from there.

    The first frame tells where ArduPilot is. A frame with a higher number answers the state. One with a lower number is of an
    ArduPilot that has started anew, perhaps at another place: that is a failure, or with `may_restart` the next state is answered.
    """

    def __init__(
        self,
        port: int,
        listen: str,
        lockstep: bool,
        timeout: float,
        resend_period: float,
        may_restart: bool,
        release: Callable[[], object],
    ) -> None:
        received = bound(socket.SOCK_DGRAM, listen, port, "json_port")
        where = f"ArduPilot that sends to {listen}:{port}"
        super().__init__(where, received, lockstep, timeout, resend_period, may_restart, release)
        self._number = -1

    def begin(self, state: VehicleState, draws: Sequence[float] = ()) -> None:
        """Send the state, or wait for the first frame."""
        self._n_packets = 0
        self.receive()  # before the state is there, so that it is not sent twice
        self._state = wire.encode_json(state)
        self.is_done = self.has_restarted or (self._peer is not None and not self.lockstep)
        if self._peer and not self.has_restarted:
            self._send()

    def _has_replaced(self, frame: wire.ServoFrame, place: tuple[str, int]) -> bool:
        return super()._has_replaced(frame, place) and frame.number < self._number

    def _restart(self, frame: wire.ServoFrame) -> None:
        super()._restart(frame)
        self._number = frame.number

    def _is_stranger(self, place: tuple[str, int]) -> bool:
        return False

    def _decode(self, data: bytes) -> wire.ServoFrame:
        return wire.decode_frame(data)

    def _take(self, frame: wire.ServoFrame) -> None:
        if frame.number < self._number and self._may_restart:
            self._restart(frame)
        elif frame.number < self._number:
            self.fail(f"it has started anew: its frame {frame.number} came after {self._number}")
        elif frame.number > self._number:
            self._number = frame.number
            self.commands = frame.pulses
            self.is_done = bool(self._sent) or not self.lockstep
        if self._state and not self._sent:
            self._send()

    def _send_state(self, data: bytes) -> None:
        assert self._peer is not None
        self._in.sendto(data, self._peer)


def _at(place: tuple[str, int]) -> str:
    return f"{place[0]}:{place[1]}"
