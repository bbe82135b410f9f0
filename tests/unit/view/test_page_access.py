"""Who may open a page, and what it takes from those who may: raw HTTP and websocket messages, from outside."""

import json
import socket
import sys
import time
from urllib.parse import urlsplit

import pytest
from page_client import PageClient
from recorded_games import hunt

from tussle import Recorder, Simulation
from tussle.errors import MissingExtraError, ViewError
from tussle.view import Live, Recording
from tussle.view.page.access import MAX_BROWSERS
from tussle.view.page.publisher import MAX_MESSAGES
from tussle.view.page.server import Page

UPGRADE = (
    "Upgrade: websocket",
    "Connection: Upgrade",
    "Sec-WebSocket-Version: 13",
    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==",
)
KINDS = pytest.mark.parametrize("is_socket", [False, True], ids=["page", "socket"])


@pytest.fixture(scope="module")
def live():
    with (
        Simulation(hunt(end=60.0, end_conditions="time"), 3) as simulation,
        Live(simulation, is_paused=True) as live,
    ):
        yield live


@pytest.fixture(scope="module", params=["live", "replay"])
def page(request, live, tmp_path_factory):
    """A page of a game that stands still, and one of a recorded run."""
    if request.param == "live":
        with Page(live) as page:
            yield page
        return
    with Simulation(hunt(), 3) as game, Recorder(game, tmp_path_factory.mktemp("runs") / "run") as recorder:
        game.step(20)
    with Page(Recording(recorder.directory)) as page:
        yield page


def status(page, path=None, *headers, host=None, origin=None, is_socket=False):
    """The status with which a request is answered, with these headers and no others."""
    address = urlsplit(page.url)
    lines = [f"GET {address.path or '/' if path is None else path} HTTP/1.1", *headers]
    if host is None:
        lines.append(f"Host: {address.netloc}")
    elif host:
        lines.append(f"Host: {host}")
    if origin is not None:
        lines.append(f"Origin: {origin}")
    lines += UPGRADE if is_socket else ("Connection: close",)
    with socket.create_connection((address.hostname, address.port), timeout=30) as connection:
        connection.sendall("\r\n".join([*lines, "", ""]).encode())
        return int(connection.makefile("rb").readline().split()[1])


def opened(page, is_socket):
    """The status of who is let in. A recorded run has no socket: its page is answered instead."""
    return 101 if is_socket and page.publisher else 200


# -- who comes in -----------------------------------------------------------------------------------------------------------------


@KINDS
def test_only_the_whole_address_opens_the_page(page, is_socket):
    path = urlsplit(page.url).path
    assert len(path.strip("/")) >= 32, "it is not to be guessed"
    assert status(page, is_socket=is_socket) == opened(page, is_socket)
    other = "/" + "0" * len(path.strip("/"))
    wrong = ["/", "//", "/index.html", other, path[:-1], f"{path}0", f"/x{path}", "/é", f"/?{path[1:]}"]
    wrong += [f"{other}/chunk-0", "/chunk-0", "/times", f"/.{path}/times"]
    for path in wrong:
        assert status(page, path, is_socket=is_socket) in ((400, 403) if "é" in path else (403,)), path


def test_data_is_served_by_its_names_and_nothing_else(page):
    path = urlsplit(page.url).path
    known = ("times", "events", "chunk-0") if page.publisher is None else ()
    for name in known:
        assert status(page, f"{path}/{name}") == 200
    for name in ("chunk-1", "chunk--1", "chunk-", "chunk-0x0", "chunk-" + "9" * 4000, "terrain", "../times", "..%2ftimes",
                 "run.json", "page.html", "times/times", "%00"):  # fmt: skip
        assert status(page, f"{path}/{name}") in (400, 404), name


def test_each_page_has_an_address_of_its_own(live):
    with Page(live) as one, Page(live) as other:
        assert urlsplit(one.url).path != urlsplit(other.url).path
        assert status(other, urlsplit(one.url).path) == 403


@KINDS
def test_loopback_names_are_served(page, is_socket):
    for name in ("127.0.0.1", "localhost", "LOCALHOST", "[::1]"):
        host = f"{name}:{page.port}"
        assert status(page, host=host, is_socket=is_socket) == opened(page, is_socket)
        assert status(page, host=host, origin=f"http://{host}", is_socket=is_socket) == opened(
            page, is_socket
        )


@KINDS
@pytest.mark.parametrize(
    "host",
    [
        "evil.example:{port}",
        "localhost.evil.example:{port}",
        "127.0.0.1:1",
        "127.0.0.1",
        "192.0.2.1:{port}",
        "127.0.0.1:{port}\r\nHost: evil.example:{port}",
        "",
    ],
)
def test_a_name_that_is_not_served_is_refused(page, is_socket, host):
    assert status(page, host=host.format(port=page.port), is_socket=is_socket) in (400, 403)


@KINDS
@pytest.mark.parametrize(
    "origin",
    [
        "http://evil.example",
        "null",
        "",
        "http://127.0.0.1:1",
        "https://127.0.0.1:{port}",
        "http://127.0.0.1:{port}.evil.example",
        "http://localhost:{port}",
        "http://127.0.0.1:{port}\r\nOrigin: http://evil.example",
    ],
)
def test_a_foreign_page_is_refused(page, is_socket, origin):
    assert status(page, origin=origin.format(port=page.port), is_socket=is_socket) == 403


@KINDS
def test_a_page_for_others_is_served_at_addresses_and_own_names_only(live, is_socket):
    with Page(live, host="0.0.0.0") as page:
        assert not page.is_local
        assert page.url.startswith("http://127.0.0.1:")
        for name in ("127.0.0.1", "localhost", "192.0.2.1", "[2001:db8::1]", socket.gethostname()):
            assert status(page, host=f"{name}:{page.port}", is_socket=is_socket) == opened(page, is_socket), (
                name
            )
        assert status(page, host=f"evil.example:{page.port}", is_socket=is_socket) == 403
        assert status(page, "/", is_socket=is_socket) == 403


def test_a_browser_is_told_to_keep_the_address_for_itself(page):
    address = urlsplit(page.url)
    with socket.create_connection((address.hostname, address.port), timeout=30) as connection:
        request = f"GET {address.path or '/'} HTTP/1.1\r\nHost: {address.netloc}\r\nConnection: close\r\n\r\n"
        connection.sendall(request.encode())
        head, _, body = connection.makefile("rb").read().partition(b"\r\n\r\n")
    assert b"referrer-policy: no-referrer" in head.lower()
    assert b"frame-ancestors 'none'" in head.lower()
    assert b"server:" not in head.lower()
    assert b"connect-src 'self'" in body
    assert b"default-src 'none'" in body


def test_garbage_instead_of_a_request_is_no_news(page, capfd):
    for garbage in (
        b"\x16\x03\x01\x02\x00",
        b"GET\r\n\r\n",
        b"POST / HTTP/1.1\r\n\r\n",
        b"BREW /x HTTP/1.1\r\n\r\n",
    ):
        with socket.create_connection(("127.0.0.1", page.port), timeout=30) as connection:
            connection.sendall(garbage)
            connection.shutdown(socket.SHUT_WR)
            connection.recv(100)
    assert status(page) == 200
    assert capfd.readouterr() == ("", "")


def test_nothing_is_uploaded(page):
    address = urlsplit(page.url)
    for method in ("POST", "PUT", "DELETE", "PATCH"):
        with socket.create_connection((address.hostname, address.port), timeout=30) as connection:
            head = f"{method} {address.path} HTTP/1.1\r\nHost: {address.netloc}\r\nContent-Length: 4\r\nConnection: close\r\n\r\nabcd"
            connection.sendall(head.encode())
            assert int(connection.makefile("rb").readline().split()[1]) == 405


def test_so_many_browsers_and_no_more(live):
    with Page(live) as page:
        clients = [PageClient(page.url, is_reading=False) for _ in range(MAX_BROWSERS)]
        try:
            assert status(page, is_socket=True) == 403
            assert status(page) == 200
        finally:
            for client in clients:
                client.close()


# -- what it takes ----------------------------------------------------------------------------------------------------------------


@pytest.fixture
def client(live):
    with Page(live) as page, PageClient(page.url) as client:
        client.wait(lambda: client.status)
        yield client
        assert page.error is None


def test_a_message_that_is_too_long_ends_its_connection_and_no_other(live, client):
    with PageClient(client._url) as other:
        other.wait(lambda: other.status)
        other.send(json.dumps({"do": "x" * 100_000}))
        other.wait(lambda: other.error is not None)
        assert other.error == 1009
    client.order("warp", value=3)
    client.wait(lambda: live.warp == 3.0)


def test_one_browser_that_sends_without_end_is_slowed_down(live, client):
    began = time.monotonic()
    for i in range(3 * MAX_MESSAGES):
        client.order("warp", value=1 + i % 2)
    client.order("warp", value=5)
    client.wait(lambda: live.warp == 5.0)
    assert time.monotonic() - began > 1.5
    told = "this page sends more than 200 messages a second; the further ones wait"
    assert 1 <= client.refusals.count(told) == len(client.refusals) <= 5


def test_one_who_sends_much_but_not_too_much_is_told_nothing(live, client):
    for _ in range(3):
        for i in range(MAX_MESSAGES // 2):
            client.order("warp", value=1 + i % 2)
        time.sleep(0.6)
    client.order("warp", value=6)
    client.wait(lambda: live.warp == 6.0)
    assert client.refusals == []


# -- where it is served -----------------------------------------------------------------------------------------------------------


def test_a_port_that_is_asked_for_and_taken_is_told(live):
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        with pytest.raises(ViewError, match=f"cannot be served at 127.0.0.1, port {port}: .*in use"):
            Page(live, port=port)


def test_a_host_that_is_not_here_is_told(live):
    with pytest.raises(ViewError, match=r"cannot be served at 192\.0\.2\.1, ports 8123 to 8222"):
        Page(live, host="192.0.2.1")
    with pytest.raises(ViewError, match=r"cannot be served at nowhere\.invalid"):
        Page(live, host="nowhere.invalid")


def test_two_pages_get_a_port_each_and_say_nothing(live, capfd):
    with Page(live) as one, Page(live) as other:
        assert one.port != other.port
        assert one.is_local
        assert one.url.startswith(f"http://127.0.0.1:{one.port}/")
    one.stop()
    assert capfd.readouterr() == ("", "")


def test_without_the_extra_it_and_the_other_way_are_named(live, monkeypatch):
    monkeypatch.setitem(sys.modules, "aiohttp", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'tussle\[view\]' \(tussle export"):
        Page(live)
