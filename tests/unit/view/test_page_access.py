"""Who may open a page, and what it takes from those who may: raw HTTP and websocket messages, from outside."""

import socket
import time
from contextlib import nullcontext
from importlib import import_module
from urllib.parse import urlsplit

import pytest
from page_client import PageClient
from recorded_games import hunt

from tussle import Recorder, Simulation
from tussle.errors import ViewError
from tussle.view import Live, Recording
from tussle.view.page.guard import Guard
from tussle.view.page.replaying import Replay
from tussle.view.page.server import Page

exceptions = import_module("websockets.exceptions")

UPGRADE = (
    "Upgrade: websocket",
    "Connection: Upgrade",
    "Sec-WebSocket-Version: 13",
    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==",
)
KINDS = pytest.mark.parametrize("is_socket", [False, True], ids=["page", "socket"])
OPENED = {False: 200, True: 101}


@pytest.fixture(scope="module", params=["live", "replay"])
def page(request, tmp_path_factory):
    """A page of a game that stands still, and one of a recorded run."""
    with Simulation(hunt(end=60.0, end_conditions="time"), 3) as simulation:
        if request.param == "live":
            with Live(simulation, is_paused=True) as live, Page(live) as page:
                yield page
            return
        with Recorder(simulation, tmp_path_factory.mktemp("runs") / "run") as recorder:
            simulation.step(20)
    with Page(Replay(Recording(recorder.directory), is_paused=True)) as page:
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


# -- who comes in -----------------------------------------------------------------------------------------------------------------


@KINDS
def test_only_the_whole_address_opens_the_page(page, is_socket):
    path = urlsplit(page.url).path
    assert len(path.strip("/")) >= 32, "it is not to be guessed"
    assert status(page, is_socket=is_socket) == OPENED[is_socket]
    other = "/" + "0" * len(path.strip("/"))
    for wrong in ("/", "//", "/index.html", other, path[:-1], f"{path}0", f"/x{path}", "/é", f"/?{path[1:]}"):
        assert status(page, wrong, is_socket=is_socket) == 403, wrong


def test_each_page_has_an_address_of_its_own():
    with (
        Simulation(hunt(), 1) as simulation,
        Live(simulation, is_paused=True) as live,
        Page(live) as one,
        Page(live) as other,
    ):
        assert urlsplit(one.url).path != urlsplit(other.url).path
        assert status(other, urlsplit(one.url).path) == 403


@KINDS
def test_loopback_names_are_served(page, is_socket):
    for name in ("127.0.0.1", "localhost", "LOCALHOST", "[::1]"):
        host = f"{name}:{page.port}"
        assert status(page, host=host, is_socket=is_socket) == OPENED[is_socket]
        assert status(page, host=host, origin=f"http://{host}", is_socket=is_socket) == OPENED[is_socket]


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
def test_a_page_for_others_is_served_at_addresses_and_own_names_only(is_socket):
    with (
        Simulation(hunt(), 1) as simulation,
        Live(simulation, is_paused=True) as live,
        Page(live, host="0.0.0.0") as page,
    ):
        for name in ("127.0.0.1", "localhost", "192.0.2.1", "[2001:db8::1]", socket.gethostname()):
            assert status(page, host=f"{name}:{page.port}", is_socket=is_socket) == OPENED[is_socket], name
        assert status(page, host=f"evil.example:{page.port}", is_socket=is_socket) == 403
        assert status(page, "/", is_socket=is_socket) == 403


def test_a_browser_is_told_to_keep_the_address_for_itself(page):
    address = urlsplit(page.url)
    with socket.create_connection((address.hostname, address.port), timeout=30) as connection:
        request = f"GET {address.path or '/'} HTTP/1.1\r\nHost: {address.netloc}\r\n\r\n"
        connection.sendall(request.encode())
        head = connection.makefile("rb").read(1000).split(b"\r\n\r\n")[0].lower()
    assert b"referrer-policy: no-referrer" in head
    assert b"frame-ancestors 'none'" in head
    assert b"server:" not in head


def test_garbage_instead_of_a_request_is_no_news(page, capfd):
    for garbage in (b"\x16\x03\x01\x02\x00", b"GET\r\n\r\n", b"POST / HTTP/1.1\r\n\r\n"):
        with socket.create_connection(("127.0.0.1", page.port), timeout=30) as connection:
            connection.sendall(garbage)
            connection.shutdown(socket.SHUT_WR)
            connection.recv(100)
    assert status(page) == 200
    assert capfd.readouterr() == ("", "")


def test_so_many_browsers_and_no_more(page):
    from tussle.view.page.access import MOST_BROWSERS

    clients = [PageClient(page.url, is_reading=False) for _ in range(MOST_BROWSERS)]
    try:
        assert status(page, is_socket=True) == 403
        assert status(page) == 200
    finally:
        for client in clients:
            client.close()


@pytest.mark.parametrize("version", ["1.0.15", "1.2.0", "2.0"])
def test_no_page_is_served_by_a_viser_that_was_not_tested(version, monkeypatch):
    monkeypatch.setattr("importlib.metadata.version", lambda name: version)
    told = rf"viser {version} .*pip install 'viser>=1.1.1,<1.2'"
    with (
        Simulation(hunt(), 1) as simulation,
        Live(simulation, is_paused=True) as live,
        pytest.raises(ViewError, match=told),
    ):
        Page(live)


def test_no_page_is_served_where_viser_cannot_be_guarded(monkeypatch):
    infra = import_module("viser.infra")
    stop, stopped = infra.WebsockServer.stop, []
    monkeypatch.setattr(Guard, "in_place", lambda _: nullcontext())
    monkeypatch.setattr(
        infra.WebsockServer, "stop", lambda server: (stop(server), stopped.append(server._port))
    )
    told = "viser did not start its server as expected"
    with (
        Simulation(hunt(), 1) as simulation,
        Live(simulation, is_paused=True) as live,
        pytest.raises(ViewError, match=told),
    ):
        Page(live)
    assert stopped
    for port in stopped:
        with pytest.raises(ConnectionRefusedError), socket.create_connection(("127.0.0.1", port), timeout=5):
            pass


# -- what it takes ----------------------------------------------------------------------------------------------------------------


@pytest.fixture
def client(page):
    with PageClient(page.url) as client:
        client.wait(lambda: client.text("t = 0.00 s"))
        yield client
        assert page.error is None


def stays(page, condition):
    """Whether it holds for who comes now, after all that was sent before has been taken."""
    time.sleep(0.3)
    with PageClient(page.url) as late:
        late.wait(lambda: late.text("t = 0.00 s"))
        return condition(late)


@pytest.mark.parametrize(
    "changes",
    [
        {"label": "mine"},
        {"visible": False},
        {"min": -1e9, "max": 1e9},
        {"update_cb": []},
        {"removed": True},
        {"value": 3.0, "label": "mine"},
        {},
        {f"a{i}": "x" for i in range(200)},
    ],
)
def test_nothing_but_the_value_of_an_element_is_set(page, client, changes):
    uuid = client.id_of("Trails [s]")
    before = dict(client.inputs[uuid])
    client.send("GuiUpdateMessage", uuid=uuid, updates=changes)
    assert stays(page, lambda late: late.inputs[late.id_of("Trails [s]")] == before)
    client.set("Trails [s]", 7.0)
    client.wait(lambda: page.display.trail_time == 7.0)
    client.set("Trails [s]", before["value"])
    client.wait(lambda: page.display.trail_time == before["value"])


@pytest.mark.parametrize(
    ("kind", "fields"),
    [
        ("GuiFormDirtyMessage", {"uuid": "x" * 5000}),
        ("GuiRemoveMessage", {"uuid": "root"}),
        ("SceneNodeUpdateMessage", {"name": "/entities/aircraft", "updates": {"visible": False}}),
        ("SetPositionMessage", {"name": "/grid", "position": (1.0, 2.0, 3.0)}),
        ("TransformControlsUpdateMessage", {"name": "/x", "wxyz": (1, 0, 0, 0), "position": (0, 0, 0), "owner": ""}),
        ("ShareUrlRequest", {}),
        ("RunJavascriptMessage", {"source": "alert(1)"}),
        ("NoSuchMessage", {}),
        (None, {}),
        (["ShareUrlRequest"], {}),
    ],
)  # fmt: skip
def test_messages_that_no_control_sends_are_ignored(page, client, kind, fields):
    for i in range(100):
        own = fields | {"uuid": f"{i}{fields['uuid']}"} if len(fields.get("uuid", "")) > 1000 else fields
        client.send(kind, **own)
    with PageClient(page.url) as late:
        late.wait(lambda: late.text("t = 0.00 s"))
        assert late.n_bytes < 400_000, "what one browser sends is kept for others"
        assert late.kinds[str(kind)] <= client.kinds[str(kind)]
    client.set("Names' size", 2.0)
    client.wait(lambda: page.display.label_scale == 2.0)
    client.set("Names' size", 1.0)
    client.wait(lambda: page.display.label_scale == 1.0)


def test_nothing_is_uploaded(page, client):
    field = client.id_of("Trails [s]")
    client.send(
        "FileTransferStartUpload", source_component_uuid=field, transfer_uuid="t", filename="f", mime_type="m",
        part_count=2, size_bytes=200,
    )  # fmt: skip
    client.send(
        "FileTransferPart", source_component_uuid=field, transfer_uuid="t", part_index=0, content=b"x" * 100
    )
    time.sleep(0.3)
    assert "FileTransferPartAck" not in client.kinds


def test_a_message_that_is_too_long_ends_its_connection_and_no_other(page, client):
    with PageClient(page.url) as other:
        other.wait(lambda: other.text("t = 0.00 s"))
        other.send("CommandTriggerMessage", uuid="x" * 100_000)
        other.wait(lambda: other.error is not None)
        assert isinstance(other.error, exceptions.ConnectionClosedError)
        assert other.error.rcvd.code == 1009
    client.set("Names' size", 3.0)
    client.wait(lambda: page.display.label_scale == 3.0)
    client.set("Names' size", 1.0)


@pytest.mark.parametrize("raw", [b"", b"\xc1", b"\x90", b"\x91" * 5000, b"\x80", b"\xa1x", "text", "{}"])
def test_what_is_no_message_is_ignored(page, client, raw):
    client._socket.send(raw)
    client.set("Names' size", 4.0)
    client.wait(lambda: page.display.label_scale == 4.0)
    client.set("Names' size", 1.0)
    client.wait(lambda: page.display.label_scale == 1.0)


def test_one_browser_that_sends_without_end_is_slowed_down(page, client):
    from tussle.view.page.access import MOST_MESSAGES

    n = 3 * MOST_MESSAGES
    began = time.monotonic()
    for i in range(n):
        client.set("Names' size", 1.0 + 0.1 * (i % 2))
    client.set("Names' size", 5.0)
    client.wait(lambda: page.display.label_scale == 5.0)
    assert time.monotonic() - began > 1.5
    client.set("Names' size", 1.0)
    client.wait(lambda: page.display.label_scale == 1.0)
