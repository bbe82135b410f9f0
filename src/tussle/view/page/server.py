"""Serves the page of a live game or of one or two recorded runs."""

from __future__ import annotations

import asyncio
import ipaddress
import os
import sys
import webbrowser
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Self

from tussle.errors import MissingExtraError
from tussle.mission import Mission
from tussle.view.live import Live
from tussle.view.page.access import (
    HEADERS,
    MAX_BROWSERS,
    MAX_BYTES,
    MAX_UNSENT,
    OPERATE,
    WATCH,
    Access,
    PageRole,
    bound_socket,
    operator_roles,
)
from tussle.view.page.assemble import page_html
from tussle.view.page.compare import Comparison
from tussle.view.page.document import game_document, scenery_blobs
from tussle.view.page.failures import Failures
from tussle.view.page.publisher import FramePublisher
from tussle.view.page.recorded import RecordedData, opening
from tussle.view.page.web_server import WebServer
from tussle.view.recording import Recording

if TYPE_CHECKING:
    from aiohttp import web

LOOPBACK = "127.0.0.1"
MAX_PERIOD = 60.0
"""Between two frames [s]: longer is no moving picture."""


class Page:
    """Serves a game in the browser from construction until `stop`.

    Nothing on the page reads files or runs code, and it asks no other server for anything. Only who has the whole address opens it,
    and what a browser sends is checked before anything is done (`tussle.view.page.access`, `tussle.view.page.commands`). Closing all
    browsers leaves the game going; a browser that is slow sees fewer frames and holds nothing up. All browsers share the time of a
    live game; of a recorded one, each has its own.

    Args:
        game: The game. The page does not stop it when it is stopped itself.
        host: Address that it is served at; others than the loopback's can be reached from other machines.
        port: Its port; None takes the first free one from 8123 on.
        mission: The mission, for how far plugins reach; None takes that of the game.
        viewer: What the mission file says for the viewer, see `tussle.mission.Loaded`; None takes that of the game.
        warp: Simulated seconds per second at which a recorded game begins; None is as fast as can be shown.
        is_paused: Whether a recorded game stands still at first.
        one_steers: Of a live game, only the browser that came first steers it; otherwise all do.
        has_roles: A live game has further addresses: for watching only, and for orders to each of its teams.
        operators: Name -> team of people who operate a team of a live game; each has an address, and orders from there have this name.

    Attributes:
        game: The game.
        host: Where it is served.
        port: Its port.
        url: Its whole address, as typed on this machine.
        addresses: Role -> address, with that of who may do everything.
        is_local: Only this machine can reach it.
        notes: What the user should know, one line each.

    Raises:
        MissingExtraError: aiohttp is not installed.
        ViewError: It cannot be served there, or there is nothing to show.
        ParameterError: An operator's name or team is not allowed.
    """

    def __init__(
        self,
        game: Live | Recording | Comparison,
        *,
        host: str = LOOPBACK,
        port: int | None = None,
        mission: Mission | None = None,
        viewer: Mapping[str, Any] | None = None,
        warp: float | None = 1.0,
        is_paused: bool = False,
        one_steers: bool = False,
        has_roles: bool = False,
        operators: Mapping[str, int] | None = None,
    ) -> None:
        _check_extra()
        self.game, self.host = game, host or LOOPBACK
        self._failures = Failures()
        roles = _roles(game, has_roles, operators or {}) if isinstance(game, Live) else []
        viewer = dict(game.viewer if viewer is None else viewer)
        notes: list[str] = []
        self._data: RecordedData | None = None
        self.publisher: FramePublisher | None = None
        if isinstance(game, Live):
            self.publisher = FramePublisher(game, self._failures, _period(viewer, notes), one_steers)
            document = (
                game_document(game, mission or game.simulation.mission, viewer) | self.publisher.document()
            )
            self._scenery = scenery_blobs(game.scenery)
        else:
            self._data = RecordedData(game, is_file=False, mission=mission, viewer=viewer)
            document = self._data.document(**opening(game), warp=warp, isPlaying=not is_paused)
        document["notes"] = self.notes = [*notes, *document["notes"]]
        self._html = page_html(document)
        bound = bound_socket(self.host, port)
        address, self.port = bound.getsockname()[:2]
        self.is_local = ipaddress.ip_address(address).is_loopback
        self._access = Access(self.host, self.port, roles)
        self.url, self.addresses = self._access.url, self._access.addresses
        publisher = self.publisher
        self._server: WebServer | None = None
        with self._failures.caught():
            self._server = WebServer(
                bound, self._admit, "tussle page", beside=[publisher.run] if publisher else [], headers=HEADERS,
                tell=self._failures.tell,
            )  # fmt: skip

    # -- the server -----------------------------------------------------------------------------------------------------------------

    async def _admit(self, request: web.Request) -> web.StreamResponse:
        """Answer a request, or refuse it."""
        from aiohttp import web

        headers = request.headers
        reason = self._access.refusal(
            request.raw_path, headers.getall("Host", []), headers.getall("Origin", [])
        )
        return web.Response(status=403, text=reason) if reason else await self._answer(request)

    async def _answer(self, request: web.Request) -> web.StreamResponse:
        """The page, its socket, or data by name."""
        from aiohttp import web

        name = request.path.strip("/").partition("/")[2]
        if not name and "Upgrade" in request.headers and self.publisher is not None:
            if len(self.publisher.readers) >= MAX_BROWSERS:
                return web.Response(status=403, text=f"{MAX_BROWSERS} browsers watch already.\n")
            socket = web.WebSocketResponse(
                max_msg_size=MAX_BYTES, compress=False, timeout=1.0, writer_limit=MAX_UNSENT
            )
            await socket.prepare(request)
            role = self._access.role_of(request.raw_path)
            assert role is not None  # `_admit` has asked
            await self.publisher.serve(socket, role)
            return socket
        if not name:
            return web.Response(text=self._html, content_type="text/html")
        data = None
        try:
            if self._data is not None:
                data = await asyncio.to_thread(self._data.blob, name)
            else:
                data = self._scenery.get(name)
        except Exception as error:  # noqa: BLE001 - whatever it is, whoever watches reads it, and the page goes on
            return web.Response(status=500, text=self._failures.tell(error))
        if data is None:
            return web.Response(status=404, text="There is nothing of this name.\n")
        return web.Response(body=data, content_type="application/octet-stream")

    # -- what it says ---------------------------------------------------------------------------------------------------------------

    @property
    def n_readers(self) -> int:
        """Number of browsers connected to a live game."""
        return len(self.publisher.readers) if self.publisher else 0

    @property
    def game_error(self) -> BaseException | None:
        """The error that stopped a live game, or None."""
        return self.game.error if isinstance(self.game, Live) else None

    @property
    def error(self) -> BaseException | None:
        """The last error of the page itself, or None."""
        return self._failures.last

    @property
    def errors(self) -> list[str]:
        """Errors of the page itself, one line each; the page shows them."""
        return self._failures.texts

    def open(self) -> None:
        """Open the page in a browser; on Linux without a display, only in the one that the user names in BROWSER."""
        names = ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")
        if not sys.platform.startswith("linux") or any(os.environ.get(name) for name in names):
            webbrowser.open(self.url)

    def stop(self) -> None:
        """Stop serving. A second call does nothing."""
        if self._server is not None:
            self._server.stop()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()


def _roles(game: Live, has_roles: bool, operators: Mapping[str, int]) -> list[PageRole]:
    """The roles besides the one that may do everything."""
    named = operator_roles(operators, game.teams)
    unnamed = [*(PageRole(OPERATE, team) for team in game.teams), PageRole(WATCH)] if has_roles else []
    return [*named, *unnamed]


def _check_extra() -> None:
    try:
        import aiohttp  # noqa: F401
    except ImportError as error:
        raise MissingExtraError(
            "the page needs aiohttp, which is not installed: pip install 'tussle[view]'"
            " (tussle export makes pages and films of a recorded run without it)"
        ) from error


def _period(viewer: Mapping[str, Any], notes: list[str]) -> float:
    """Return the time between frames that the mission sets [s]; 0 if it sets none. Invalid values are added to `notes`."""
    text = viewer.get("gui_update_period")
    try:
        period = 0.0 if text is None else 1e-3 * float(text)
    except ValueError:
        period = -1.0
    if not 0.0 <= period < MAX_PERIOD:
        notes.append(f"gui_update_period {text!r} is no time in ms; frames are sent as fast as can be")
        return 0.0
    return period
