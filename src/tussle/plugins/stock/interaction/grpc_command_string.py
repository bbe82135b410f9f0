"""Texts from programs, by gRPC."""

from __future__ import annotations

import errno
import re
import socket
from collections import deque
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from tussle.api import Interaction, Param, WorldView
from tussle.declare.messages import Messages, TextMessage
from tussle.errors import PortError, clipped, listed, nearest_name
from tussle.plugins.links.ports import opening
from tussle.plugins.links.rpc import COMMANDS, SEND_COMMAND, load_grpc, message_types

MAX_WAITING = 10_000
"""Commands that wait for the next step; further ones are refused."""
MAX_BYTES = 1024 * 1024
ONE_ENTITY = re.compile(r"/(\d{1,9})/(.+)", re.DOTALL)
"""Topic of the existing system for one entity: its id and the topic."""


class GRPCCommandString(Interaction):
    """Publishes texts that programs send by gRPC, as `TextMessage`, on the network and the topic that they name, in all worlds.

    The service is that of the existing system, `SendCommandString` of `scrimmage_msgs.ScrimmageMsgService`, so that its clients work
    unchanged. A topic "/3/State" is the topic "State", for entity 3 only; `CommandStringRelay` passes texts on to the entity's other
    plugins. Entities receive a text in the step after the one that publishes it. A command for a topic that no plugin listens to, or
    for an entity that has never been, is answered by an error that names what there is; there, it was lost. Whoever reaches the port
    may send commands.

    Raises:
        MissingExtraError: grpcio or protobuf are not installed.
        PortError: The port is taken, or the address is not one of this machine.
    """

    grade = "external"

    ip = Param("localhost", doc="Own address that is served.")
    port = Param(60000, structural=True, ge=1, le=65535, doc="Its port.")

    def start(self, w: WorldView) -> None:
        """Serve."""
        server = self._server(w)
        server.last_id = int(w.id.max(initial=0))

    def step(self, w: WorldView) -> None:
        """Publish what has come."""
        server = self._server(w)
        server.last_id = max(server.last_id, int(w.id.max(initial=0)))
        waiting, worlds = server.waiting, np.array(w.active_worlds(), np.int64)
        for _ in range(len(waiting)):
            network, topic, text, to = waiting.popleft()
            fields = {"text": text, "to": to}
            batch = Messages.make(TextMessage, worlds, np.zeros(len(worlds), np.int64), fields)
            w.context.topic(network, topic, TextMessage, self.instance_name).add(batch)

    def _server(self, w: WorldView) -> CommandServer:
        server: CommandServer = w.context.share(
            (GRPCCommandString, self.ip, self.port),
            lambda: CommandServer(
                self.ip,
                self.port,
                sorted({(t.network, t.name) for t in w.by_type.get(TextMessage, ()) if t.inboxes}),
            ),
        )
        return server


def _check_port(host: str, port: int) -> None:
    """Check that a port is free at all addresses of a host, of which gRPC is content with one.

    Raises:
        PortError: Another program has it.
    """
    try:
        places = socket.getaddrinfo(host.strip("[]"), port, type=socket.SOCK_STREAM)
    except (OSError, UnicodeError):  # names of gRPC's own, such as those of Unix sockets
        return
    for family, kind, protocol, _, place in places:
        with opening("port", host, port):
            try:
                with socket.socket(family, kind, protocol) as probe:
                    probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
                    if family == socket.AF_INET6:
                        probe.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, 1)
                    probe.bind(place)
            except OSError as error:  # a machine without IPv6 may still have the name
                if error.errno == errno.EADDRINUSE:
                    raise


class CommandServer:
    """A gRPC server that takes commands.

    Args:
        ip: Own address that is served.
        port: Its port.
        subscribed: Network and name of each topic that plugins listen to.

    Attributes:
        last_id: Largest id of an entity that has been born.
        waiting: Network, topic, text, and id of the entity that it is for or 0, of commands that are not yet published.
    """

    def __init__(self, ip: str, port: int, subscribed: list[tuple[str, str]]) -> None:
        grpc = load_grpc("GRPCCommandString")
        self.waiting: deque[tuple[str, str, str, int]] = deque()
        self._subscribed, self._status, self.last_id = subscribed, grpc.StatusCode, 0
        types = message_types("scrimmage_msgs", **COMMANDS)
        self._ack = types["CommandAck"]
        _, service, method = SEND_COMMAND.split("/")
        handler = grpc.unary_unary_rpc_method_handler(
            self._take, types["CommandString"].FromString, self._ack.SerializeToString
        )
        # Without the first option, two servers share a port in silence.
        options = [("grpc.so_reuseport", 0), ("grpc.max_receive_message_length", MAX_BYTES)]
        self._server = grpc.server(ThreadPoolExecutor(2, "gRPC commands"), options=options)
        self._server.add_generic_rpc_handlers(
            [grpc.method_handlers_generic_handler(service, {method: handler})]
        )
        try:
            _check_port(ip, port)
            self._server.add_insecure_port(f"{ip}:{port}")
        except RuntimeError:
            raise PortError(
                f"port: {ip}:{port} cannot be opened: it is taken, or ip is no address of this machine"
            ) from None
        self._server.start()

    def _take(self, command: Any, call: Any) -> Any:
        network, topic, to = command.network or "GlobalNetwork", command.topic, 0
        if found := ONE_ENTITY.fullmatch(topic):
            to, topic = int(found[1]), found[2]
            if not 0 < to <= self.last_id:
                call.abort(
                    self._status.INVALID_ARGUMENT,
                    f"topic {clipped(command.topic)!r}: no entity has had the id {to}; ids are 1 to {self.last_id}",
                )
        if (network, topic) not in self._subscribed:
            names = [" ".join(each) for each in self._subscribed]
            near = nearest_name(f"{network} {topic}", names)
            call.abort(
                self._status.INVALID_ARGUMENT,
                f"no plugin listens to texts on network {clipped(network)!r}, topic {clipped(topic)!r}{near}; {listed(names)}",
            )
        if len(self.waiting) >= MAX_WAITING:
            call.abort(self._status.RESOURCE_EXHAUSTED, f"{MAX_WAITING} commands wait for the next step")
        self.waiting.append((network, topic, command.value, to))
        return self._ack(success=1)

    def end(self) -> None:
        """Close the port; called when the simulation is closed."""
        self._server.stop(grace=None).wait()
