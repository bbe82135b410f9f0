"""The HTTP server of the page and of `tussle serve`."""

from __future__ import annotations

import gc
import socket
import warnings

from aiohttp import web

from tussle.view.page.web_server import WebServer


def test_a_connection_that_is_not_read_is_closed_when_it_stops(recwarn):
    """A browser may hang in the middle of an answer that is larger than all buffers on its way."""
    bound = socket.create_server(("127.0.0.1", 0))
    begun = []

    async def admit(_):
        begun.append(True)
        return web.Response(body=bytes(50_000_000))

    server = WebServer(bound, admit, "hanging")
    with socket.create_connection(bound.getsockname()) as client:
        client.sendall(b"GET / HTTP/1.1\r\nHost: here\r\n\r\n")
        assert client.recv(1)
        warnings.simplefilter("always")
        server.stop()
        gc.collect()
    assert begun
    assert [str(each.message) for each in recwarn] == []
