"""A connection with a MOOSDB."""

from __future__ import annotations

import selectors
import socket
import threading
import time
from collections.abc import Callable, Iterable
from contextlib import suppress

from tussle.declare import texts
from tussle.plugins.stock.autonomy.moos import wire

RETRY = 0.1
"""Time between attempts to connect [s]."""
TIMING_PERIOD = 1.0
"""Time between the signs of life that a client sends [s]."""
MAX_ATTEMPT = 2.0
"""Longest wait for an answer before another attempt [s]."""
MAX_PER_SECOND = 2000
"""Messages per second, and at once, beyond which a peer is not listened to. A helm sends some tens."""
CLOSED = "the connection was closed"


class ConnectionLostError(ConnectionError):
    """The MOOSDB has ended the connection, or has gone."""


class MoosClient:
    """A client of a MOOSDB, whose mail is read by a thread of its own, so that it is read while a simulation is paused; see `start`.

    Args:
        host: Where the MOOSDB is.
        port: Its port.
        name: Name of this client, unique in the community.
        community: Name that the community must have; empty for any.
        variables: Variables whose values are sent to this client.
        timeout: Longest wait for a MOOSDB that does not read what is sent [s].
        receive: Called by the thread for each message of mail, while it holds `changed`.
        lose: Called by the thread when the connection is lost, while it holds `changed`; it then connects anew. None ends with the
            connection.

    Attributes:
        community: Name of the community; empty while it is unknown.
        trouble: Why there is no connection; empty while there is one.
        n_lost: How often the connection was lost.
        failure: Why there will be no connection any more; empty if all is well.
        changed: Notified after mail and failures.
    """

    def __init__(
        self,
        host: str,
        port: int,
        name: str,
        community: str,
        variables: Iterable[str],
        timeout: float,
        receive: Callable[[wire.MoosMessage], None],
        lose: Callable[[], None] | None = None,
    ) -> None:
        self.host, self.port, self.name, self.community = host, port, name, community
        self.trouble, self.failure, self.n_lost = "no answer", "", 0
        self.changed = threading.Condition()
        self._variables, self._timeout = tuple(variables), timeout
        self._receive, self._lose = receive, lose
        self._socket: socket.socket | None = None
        self._received = bytearray()
        self._sending = threading.Lock()
        self._is_closing = threading.Event()
        self._allowance = float(MAX_PER_SECOND)
        self._heads: tuple[bytes, bytes] = (b"", b"")
        self._thread = threading.Thread(target=self._run, name=f"MOOS {host}:{port}", daemon=True)

    def start(self) -> None:
        """Begin to connect."""
        self._thread.start()

    def fail(self, why: str) -> None:
        """End the connection; the first reason is kept."""
        with self.changed:
            if not self.failure and not self._is_closing.is_set():
                community = texts.shown(self.community) if self.community else "unknown"
                place = f"{self.host}:{self.port} (community {community})"
                self.failure = f"MOOSDB at {place}: {why}"
            self.changed.notify_all()

    def close(self) -> None:
        """End the connection and its thread."""
        self._is_closing.set()
        with suppress(OSError):  # it is closed already
            if self._socket:
                self._socket.shutdown(socket.SHUT_RDWR)
        self._thread.join(2.0 * MAX_ATTEMPT)  # longer only while the name of the host is looked up

    def allow(self, n: int) -> None:
        """Let the peer send this many messages more than it may send in its time."""
        with self.changed:
            self._allowance = min(self._allowance + n, MAX_PER_SECOND)

    def number(self, tail: bytes) -> bytes:
        """The message that sets a variable to a number; tail: see `wire.encode_tail`."""
        return wire.joined(self._heads[0], tail)

    def text(self, tail: bytes) -> bytes:
        """The message that sets a variable to a text."""
        return wire.joined(self._heads[1], tail)

    def send(self, messages: list[bytes]) -> None:
        """Send a packet. An error ends the connection; without one, nothing is sent."""
        if self._socket and not (self.failure or self.trouble):
            try:
                with self._sending:
                    self._socket.sendall(wire.packet(messages))
            except OSError as error:
                if self._lose is None:
                    self.fail(f"nothing can be sent: {error.strerror or error}")
                with suppress(OSError):  # the thread finds it closed, and connects anew
                    self._socket.shutdown(socket.SHUT_RDWR)

    # -- the thread ----------------------------------------------------------------------------------------------------------------

    def _run(self) -> None:
        try:
            while True:
                try:
                    self._serve()
                except (ConnectionLostError, ConnectionResetError, BrokenPipeError, TimeoutError) as error:
                    if self._lose is None or self._is_closing.is_set():
                        raise
                    with self.changed:
                        self.trouble, self.n_lost = error.strerror or str(error) or CLOSED, self.n_lost + 1
                        self._lose()
                        self.changed.notify_all()
                    if self._socket:
                        self._socket.close()
        except ValueError as error:
            self.fail(f"this is not the protocol of MOOS: {error}")
        except OSError as error:
            self.fail(error.strerror or str(error))
        finally:
            if self._socket:
                self._socket.close()  # not before the reason is kept: `send` would find a closed socket, and call that the reason

    def _serve(self) -> None:
        """Connect, and read mail until the connection ends."""
        connection = self._connected()
        self._heads = (
            wire.encode_head(wire.NOTIFY, False, self.name, self.community),
            wire.encode_head(wire.NOTIFY, True, self.name, self.community),
        )
        register = wire.encode_head(wire.REGISTER, False, self.name, self.community)
        self.send([wire.joined(register, wire.encode_tail(k, 0.0, 0.0)) for k in self._variables])
        self._read(connection)

    def _connected(self) -> socket.socket:
        """Connect, trying again until there is a connection; returns the socket."""
        while not self._is_closing.is_set():
            try:
                self._socket = socket.create_connection((self.host, self.port), MAX_ATTEMPT)
                self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            except OSError as error:
                self.trouble = error.strerror or str(error)
            else:
                try:
                    trouble = self._refusal(self._socket)
                except (TimeoutError, ConnectionResetError, BrokenPipeError) as error:
                    trouble = error.strerror or "no answer"
                if not trouble:
                    self._socket.settimeout(self._timeout)
                    self.trouble = ""
                    return self._socket
                self.trouble = trouble
                self._socket.close()
            self._is_closing.wait(RETRY)
        raise ConnectionError(CLOSED)

    def _refusal(self, connection: socket.socket) -> str:
        """Introduce this client; returns why the MOOSDB does not welcome it, or nothing."""
        head = wire.encode_head(wire.IDENTITY, True)
        hello = wire.packet([wire.joined(head, wire.encode_tail("asynchronous", self.name, time.time()))])
        connection.sendall(wire.PROTOCOL + hello)
        self._received.clear()
        limit, messages = time.monotonic() + MAX_ATTEMPT, None
        while messages is None:
            connection.settimeout(max(limit - time.monotonic(), 0.001))
            data = b"" if self._is_closing.is_set() else connection.recv(4096)
            if not data:
                return CLOSED
            self._received += data
            messages = wire.take_packet(self._received)
        answer = messages[0] if len(messages) == 1 else None
        if answer is not None and answer.kind == wire.POISON:
            return f"it refuses the name {self.name}: {texts.shown(answer.text)}"
        if answer is None or answer.kind != wire.WELCOME:
            raise ValueError("no welcome")
        if self.community and answer.community != self.community:
            raise ConnectionError(f"its community is {texts.shown(answer.community)}")
        self.community = answer.community
        return ""

    def _read(self, connection: socket.socket) -> None:
        """Read mail until the connection ends."""
        filled, told = time.monotonic(), 0.0
        timing = wire.encode_head(wire.TIMING, False, self.name, self.community)
        with selectors.DefaultSelector() as selector:
            selector.register(connection, selectors.EVENT_READ)
            self._deliver(0.0)  # what came with the welcome
            while not self._is_closing.is_set():
                is_there = selector.select(TIMING_PERIOD)
                now = time.monotonic()
                if is_there:
                    data = connection.recv(65536)
                    if not data:
                        raise ConnectionLostError(CLOSED)
                    self._received += data
                    self._deliver(now - filled)
                    filled = now
                if now - told >= TIMING_PERIOD:
                    self.send([wire.joined(timing, wire.encode_tail("_async_timing", 0.0, time.time()))])
                    told = now

    def _deliver(self, elapsed: float) -> None:
        """Pass on the mail of all packets that are complete."""
        with self.changed:
            self._allowance = min(self._allowance + MAX_PER_SECOND * elapsed, MAX_PER_SECOND)
            while (messages := wire.take_packet(self._received)) is not None:
                mail = [message for message in messages if message.kind == wire.NOTIFY]
                self._allowance -= len(mail)
                if self._allowance < 0.0:
                    raise ConnectionError(f"more than {MAX_PER_SECOND} messages per second")
                for message in mail:
                    self._receive(message)
            self.changed.notify_all()
