"""Puts viser's server behind the page's own rules of access and of what is taken."""

from __future__ import annotations

import asyncio
import contextlib
import importlib.metadata
import logging
import re
import socket
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from importlib import import_module
from types import SimpleNamespace
from typing import Any

from tussle.errors import ViewError
from tussle.view.page.access import HEADERS, MOST_BROWSERS, MOST_BYTES, MOST_MESSAGES, Access
from tussle.view.page.incoming import is_taken, refusal

FIRST, LAST = (1, 1, 1), (1, 2)
"""Versions of viser whose server is known: from the first, before the last."""
Found = Callable[[Any, str], Any]
"""Gives the control of a page by the websocket that its value comes from and its id; None where there is none."""
Refused = Callable[[Any, str, str], None]
"""Told the websocket, the control and why its value was refused."""

PORT = 8123
"""Where it is served when no port is asked for and this one is free; else at one of the next."""
MOST_PORTS = 100

_patching = threading.Lock()


class Guard:
    """Stands between browsers and viser's server.

    viser lets nobody look at requests and messages before it does what they say. So the function that starts its server is another
    one while the server is made: on a socket that is bound already, with our rules before its own.

    Args:
        bound: The socket that it is served at.
        access: Who may open the page.
        find: Finds controls.
        refuse: Told of refused values.
        fail: Told of errors while messages are handled.

    Attributes:
        is_in_place: The server was started behind this guard.
    """

    def __init__(
        self,
        bound: socket.socket,
        access: Access,
        find: Found,
        refuse: Refused,
        fail: Callable[[BaseException], None],
    ) -> None:
        self._socket, self._access = bound, access
        self._find, self._refuse, self._fail = find, refuse, fail
        self.is_in_place = False

    @contextlib.contextmanager
    def in_place(self) -> Iterator[None]:
        """Within, the server is to be made.

        Raises:
            ViewError: This is not a viser whose server is known.
        """
        version = importlib.metadata.version("viser")
        if not FIRST <= tuple(int(part) for part in re.findall(r"\d+", version)[:3]) < LAST:
            names = [".".join(map(str, v)) for v in (FIRST, LAST)]
            wanted = f"viser>={names[0]},<{names[1]}"
            raise ViewError(
                f"viser {version} is not one whose server can be guarded; nothing is served: pip install '{wanted}'"
            )
        module, package = import_module("viser.infra._infra"), import_module("websockets")
        guarded = SimpleNamespace(asyncio=SimpleNamespace(server=SimpleNamespace(serve=self.serve)))
        with _patching:
            module.websockets = SimpleNamespace(**{**vars(package), **vars(guarded)})  # type: ignore[attr-defined]
            try:
                yield
            finally:
                module.websockets = package  # type: ignore[attr-defined]

    def serve(
        self, handler: Callable[[Any], Any], host: str, port: int, *, process_request: Any, **options: Any
    ) -> Any:
        """Start the server, called as that of websockets is."""
        server = import_module("websockets.asyncio.server")
        self.is_in_place = True
        loop = asyncio.get_running_loop()
        loop.set_exception_handler(
            lambda _, context: self._fail(context.get("exception") or ViewError(context["message"]))
        )
        log = logging.getLogger(__name__)  # silent: a traceback for each port scan is no news
        log.addHandler(logging.NullHandler())
        log.propagate = False
        return server.serve(
            handler, sock=self._socket, process_request=self._admitted(process_request), server_header=None, logger=log,
            create_connection=self._connection_class(server.ServerConnection), **{**options, "max_size": MOST_BYTES},
        )  # fmt: skip

    def _admitted(self, answer: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
        access = self._access

        def admit(connection: Any, request: Any) -> Any:
            headers = request.headers
            reason = access.refusal(request.path, headers.get_all("Host"), headers.get_all("Origin"))
            if not reason and "Upgrade" in headers and len(connection.server.connections) >= MOST_BROWSERS:
                reason = f"{MOST_BROWSERS} browsers watch already.\n"
            if reason:
                return connection.respond(403, reason)
            response = answer(connection, replace(request, path=access.path_within(request.path)))
            if response is not None:
                response.headers.update(HEADERS)
            return response

        return admit

    def _connection_class(self, base: Any) -> Any:
        guard = self

        class GuardedConnection(base):  # type: ignore[misc]
            """A websocket on which only what the page takes arrives, and no faster than it can be looked after."""

            _free_at = 0.0

            async def recv(self, decode: bool | None = None) -> Any:
                while True:
                    now = time.monotonic()
                    self._free_at = max(self._free_at, now - 1.0) + 1.0 / MOST_MESSAGES
                    await asyncio.sleep(max(0.0, self._free_at - now))
                    raw = await super().recv(decode)
                    if guard._takes(self, raw):
                        return raw

        return GuardedConnection

    def _takes(self, connection: Any, raw: Any) -> bool:
        """Whether a message is one that the page takes; a value that its control does not offer is told."""
        msgspec = import_module("msgspec")
        try:
            message: Any = msgspec.msgpack.decode(raw) if isinstance(raw, bytes) else None
        except (msgspec.MsgspecError, ValueError, RecursionError):
            return False
        if not is_taken(message):
            return False
        if message["type"] != "GuiUpdateMessage":
            return True
        control = self._find(connection, message["uuid"])
        if control is None:
            return False
        reason = refusal(control, message["updates"]["value"])
        if reason:
            self._refuse(connection, str(control.label), reason)
        return not reason


def bound_socket(host: str, wanted: int | None) -> socket.socket:
    """A socket at a port that can be served at: the one that is wanted, or the first free one.

    Raises:
        ViewError: There is none, the one that is wanted is taken, or the host is not this machine's.
    """
    ports = [wanted] if wanted is not None else list(range(PORT, PORT + MOST_PORTS))
    refusal: OSError | None = None
    for port in ports:
        try:
            family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
            bound = socket.socket(family, kind, protocol)
        except OSError as error:
            refusal = error
            break
        try:
            bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            bound.bind(address)
            bound.listen()
        except OSError as error:
            refusal = error
            bound.close()
        else:
            return bound
    where = f"port {wanted}" if wanted is not None else f"ports {PORT} to {PORT + MOST_PORTS - 1}"
    raise ViewError(f"the page cannot be served at {host}, {where}: {refusal}")
