"""A MOOSDB for tests: communities on ports of the loopback interface, which speak the wire format of MOOS 10 and accept nothing else.

    python moos_database.py FILE.moos        serves the community of a mission file until it is killed

The format is written down here once more, apart from the product's: a client sends 32 bytes, "ELKS CAN'T DANCE 2/8/10" and zeros, and
then packets: bytes (int32, with this header), messages (int32), 0 (int8). A message is: bytes (int32, with these), number (int32),
kind and data (a character each), four texts (int32 length, bytes), three doubles, a text; all little endian. Mail is sent to those who
registered for a variable, the sender too, and whoever registers gets the present value.
"""

from __future__ import annotations

import contextlib
import selectors
import socket
import struct
import sys
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path

MAGIC = b"ELKS CAN'T DANCE 2/8/10" + bytes(9)


def text(data):
    data = data.encode() if isinstance(data, str) else data
    return struct.pack("<i", len(data)) + data


def message(kind, key, value, source="", community="", when=0.0, extra=""):
    """A message as bytes; a value that is a str is sent as a text, and `extra` beside a number."""
    is_text = isinstance(value, str)
    numbers = struct.pack("<ddd", when, -1.0 if is_text else value, -1.0)
    body = struct.pack("<i2s", -1, (kind + ("S" if is_text else "D")).encode())
    body += (
        text(source) + text("") + text(community) + text(key) + numbers + text(value if is_text else extra)
    )
    return struct.pack("<i", len(body) + 4) + body


def packet(*messages):
    return struct.pack("<iib", 9 + sum(map(len, messages)), len(messages), 0) + b"".join(messages)


def parse(data):
    """Messages of a whole packet: (kind, key, value, source, community, time). Fails where a byte is not as the format says."""
    n_bytes, n, compressed = struct.unpack_from("<iib", data)
    assert (n_bytes, compressed) == (len(data), 0)
    at, found = 9, []
    for _ in range(n):
        length, _, kind, sort = struct.unpack_from("<iicc", data, at)
        end, at, texts = at + length, at + 10, []
        for k in range(5):
            if k == 4:
                when, number, _ = struct.unpack_from("<ddd", data, at)
                at += 24
            (size,) = struct.unpack_from("<i", data, at)
            assert size >= 0
            texts.append(data[at + 4 : at + 4 + size].decode())
            at += 4 + size
        assert at == end, "a message does not end where it says"
        assert sort in (b"D", b"S")
        source, _, community, key, string = texts
        found.append((kind.decode(), key, string if sort == b"S" else number, source, community, when))
    assert at == len(data), "a packet does not end where it says"
    return found


def packets(received):
    """Remove all whole packets from what was received, and return them."""
    found = []
    while len(received) >= 4 and len(received) >= (length := struct.unpack_from("<i", received)[0]):
        found.append(bytes(received[:length]))
        del received[:length]
    return found


@dataclass
class Client:
    """One connection."""

    socket: socket.socket
    community: Community
    received: bytearray = field(default_factory=bytearray)
    has_greeted: bool = False
    name: str = ""
    registered: set = field(default_factory=set)


@dataclass
class Community:
    """What one MOOSDB knows."""

    name: str
    port: int
    clients: dict = field(default_factory=dict)
    values: dict = field(default_factory=dict)
    log: list = field(default_factory=list)


class MoosDatabase:
    """Communities on neighbouring ports, served by one thread.

    Args:
        n: How many communities.
        port: The first port; 0 for any that are free.
        names: Name of the first community; the others get numbers.
    """

    def __init__(self, n=1, port=0, name="alpha"):
        self.listeners, self.port = listening(n, port)
        names = [name, *(f"{name}_{k}" for k in range(1, n))]
        self.communities = [Community(own, self.port + k) for k, own in enumerate(names)]
        self.violations = []
        self.lock = threading.Lock()
        self.selector = selectors.DefaultSelector()
        for listener, community in zip(self.listeners, self.communities, strict=True):
            self.selector.register(listener, selectors.EVENT_READ, community)
        self.is_over = False
        self.thread = threading.Thread(target=self.serve, daemon=True)
        self.thread.start()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    @property
    def clients(self):
        return [client for community in self.communities for client in community.clients.values()]

    def close(self):
        """End all connections."""
        self.is_over = True
        self.thread.join()
        for key in list(self.selector.get_map().values()):
            key.fileobj.close()
        self.selector.close()

    def serve(self):
        while not self.is_over:
            for key, _ in self.selector.select(0.02):
                with self.lock:
                    if isinstance(key.data, Community):
                        self.accept(key.fileobj, key.data)
                    elif key.data.socket.fileno() >= 0:
                        self.read(key.data)

    def accept(self, listener, community):
        connection, _ = listener.accept()
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        client = Client(connection, community)
        self.selector.register(connection, selectors.EVENT_READ, client)

    def read(self, client):
        try:
            data = client.socket.recv(1 << 16)
        except OSError:
            data = b""
        if not data:
            return self.drop(client)
        client.received += data
        try:
            if not client.has_greeted and len(client.received) >= len(MAGIC):
                assert client.received[: len(MAGIC)] == MAGIC, "the protocol has another name"
                del client.received[: len(MAGIC)]
                client.has_greeted = True
            for whole in packets(client.received) if client.has_greeted else ():
                self.handle(client, parse(whole))
        except (AssertionError, ValueError, struct.error) as error:
            self.violations.append(f"{client.name}: {error!r}")
            self.drop(client)
        return None

    def drop(self, client):
        """End a connection."""
        with contextlib.suppress(KeyError, ValueError):
            self.selector.unregister(client.socket)
        client.socket.close()
        if client.community.clients.get(client.name) is client:
            del client.community.clients[client.name]

    def send(self, client, *messages):
        with contextlib.suppress(OSError):
            client.socket.sendall(packet(*messages))

    def handle(self, client, messages):
        community = client.community
        if not client.name:
            ((kind, key, name, *_),) = messages
            assert (kind, key) == ("i", "asynchronous"), "no introduction"
            assert name, "no name"
            if name in community.clients:
                self.send(client, message("K", "", f'A client of this name ("{name}") already exists'))
                return self.drop(client)
            client.name, community.clients[name] = name, client
            return self.send(client, message("W", "", 0.0, "", community.name, extra="asynchronous"))
        mail = {}
        for kind, key, value, source, origin, when in messages:
            assert source == client.name, f"{source} is not the name of {client.name}"
            assert origin == community.name, f"{origin} is not the community {community.name}"
            if kind == "R":
                client.registered.add(key)
                if key in community.values:
                    mail.setdefault(id(client), (client, []))[1].append(community.values[key])
            elif kind == "T":
                assert (key, len(messages)) == ("_async_timing", 1)
                self.send(client, message("T", key, time.time()))
            else:
                assert kind == "N", f"a message of the kind {kind}"
                copy = message("N", key, value, source, origin, when)
                community.values[key] = copy
                community.log.append((key, value, source, when))
                for other in community.clients.values():
                    if key in other.registered:
                        mail.setdefault(id(other), (other, []))[1].append(copy)
        for other, copies in mail.values():
            self.send(other, *copies)
        return None

    def read_values(self, key, community=0):
        """All values that a variable has had."""
        with self.lock:
            return [value for name, value, *_ in self.communities[community].log if name == key]


def listening(n, port):
    """Sockets that listen to n neighbouring ports, and the first port."""
    while True:
        found = []
        try:
            for k in range(n):
                listener = socket.socket()
                found.append(listener)
                listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
                listener.bind(("127.0.0.1", port + k if port or not k else found[0].getsockname()[1] + k))
                listener.listen(16)
        except (OSError, OverflowError):  # a port of the row is taken
            for listener in found:
                listener.close()
            if port:
                raise
        else:
            return found, found[0].getsockname()[1]


def said(path):
    """The lines "key = value" of a mission file."""
    lines = (line.partition("//")[0].partition("=") for line in Path(path).read_text().splitlines())
    return {key.strip(): value.strip() for key, is_value, value in lines if is_value}


if __name__ == "__main__":
    values = said(sys.argv[1])
    MoosDatabase(port=int(values["ServerPort"]), name=values["Community"]).thread.join()
