"""An HTTP server in a thread of its own: that of the page and that of `tussle serve`."""

from __future__ import annotations

import asyncio
import logging
import socket
import threading
from collections.abc import Awaitable, Callable, Coroutine, Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from aiohttp import web

JOIN_TIME = 10.0
"""Time that the thread may take to end [s]."""


class WebServer:
    """Serves from construction until `stop`. It prints nothing: a traceback for each port scan is no news.

    Args:
        bound: The socket, bound and listening.
        admit: Answers a request.
        name: Name of the thread.
        beside: Functions that return coroutines which run beside the server, in its loop, until it stops.
        before_end: Coroutine function that is awaited before the server stops.
        headers: Headers of all answers.
        tell: Receives errors that nobody awaits.

    Raises:
        Exception: The server cannot be set up; it is the error of the set-up.
    """

    def __init__(
        self,
        bound: socket.socket,
        admit: Callable[[web.Request], Awaitable[web.StreamResponse]],
        name: str,
        *,
        beside: Sequence[Callable[[], Coroutine[Any, Any, None]]] = (),
        before_end: Callable[[], Awaitable[None]] | None = None,
        headers: Mapping[str, str] | None = None,
        tell: Callable[[BaseException], object] = lambda error: None,
    ) -> None:
        self._bound, self._admit, self._headers, self._tell = bound, admit, dict(headers or {}), tell
        self._beside, self._before_end = beside, before_end
        self._failures: list[Exception] = []
        self._is_up = threading.Event()
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()
        self._is_up.wait()
        if self._failures:
            bound.close()
            raise self._failures[0]

    def stop(self) -> None:
        """Stop serving. A second call does nothing."""
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._stopping.set)
            self._thread.join(JOIN_TIME)

    def _run(self) -> None:
        """Body of the thread; reports when the server is ready or has failed."""
        try:
            asyncio.run(self._serve())
        except Exception as error:  # noqa: BLE001 - whoever waits for the set-up gets it; later ones are told
            if self._is_up.is_set():
                self._tell(error)
            self._failures.append(error)
        self._is_up.set()

    async def _serve(self) -> None:
        from aiohttp import web

        self._loop, self._stopping = asyncio.get_running_loop(), asyncio.Event()
        self._loop.set_exception_handler(
            lambda _, context: self._tell(context.get("exception") or RuntimeError(context["message"]))
        )
        app = web.Application()
        app.router.add_get("/{tail:.*}", self._admit)
        app.on_response_prepare.append(self._set_headers)
        log = logging.getLogger(__name__)
        log.addHandler(logging.NullHandler())
        log.propagate = False
        runner = web.AppRunner(app, access_log=None, logger=log, handle_signals=False, shutdown_timeout=0.1)
        await runner.setup()
        await web.SockSite(runner, self._bound).start()
        tasks = [asyncio.create_task(each()) for each in self._beside]
        self._is_up.set()
        await self._stopping.wait()
        for task in tasks:
            task.cancel()
        if self._before_end is not None:
            await self._before_end()
        connections = [each.transport for each in runner.server.connections] if runner.server else []
        await runner.cleanup()
        for connection in connections:  # one whose browser does not read stays open
            if connection is not None:
                connection.abort()
        await asyncio.sleep(0)

    async def _set_headers(self, _: web.Request, response: web.StreamResponse) -> None:
        response.headers.update(self._headers)
        response.headers.popall("Server", None)
