"""Serves the page."""

from __future__ import annotations

import contextlib
import ipaddress
import threading
from collections.abc import Iterator, Mapping
from typing import Any, Self

from tussle.errors import MissingExtraError, ViewError
from tussle.mission import Mission
from tussle.view.frame import Frame
from tussle.view.live import Live
from tussle.view.page.access import Access
from tussle.view.page.camera import FIELD_OF_VIEW, opening
from tussle.view.page.comparing import Comparison
from tussle.view.page.display import Display
from tussle.view.page.drawn import Drawn
from tussle.view.page.failures import Failures
from tussle.view.page.ground import background_image, draw_ground, light
from tussle.view.page.guard import Guard, bound_socket
from tussle.view.page.keyboard import Keyboard
from tussle.view.page.labels import Labels
from tussle.view.page.overlays import Overlays
from tussle.view.page.panel import Panel
from tussle.view.page.pusher import Parts, Pusher
from tussle.view.page.source import Source
from tussle.view.page.stage import Stage
from tussle.view.page.trails import Trails
from tussle.view.page.visitor import Visitor

LOOPBACK = "127.0.0.1"
MOST_PERIOD = 60.0
"""Between two frames [s]: longer is no moving picture."""
TEAL = (0, 110, 120)


class Page:
    """A game on a page in the browser, from when this is made until `stop`.

    Nothing on the page reads files or runs code, and it asks no other server for anything. Only who has the whole address opens it,
    and what a browser sends is checked before anything is done (`tussle.view.page.access`, `tussle.view.page.incoming`). Closing all
    browsers leaves the game going; a browser that is slow sees fewer frames and holds nothing up.

    Args:
        source: The game. The page does not stop it when it is stopped itself.
        host: Address that it is served at; others than the loopback's can be reached from other machines.
        port: Its port; None takes the first free one from 8123 on.
        mission: The mission, for how far plugins reach; None where it is not known.
        viewer: What the mission file says for the viewer, see `tussle.mission.Loaded`.

    Attributes:
        host: Where it is served.
        display: What is shown.
        url: Its whole address, as typed on this machine.
        is_local: Only this machine can reach it.

    Raises:
        MissingExtraError: viser is not installed.
        ViewError: It cannot be served there, or not by this version of viser.
    """

    def __init__(
        self,
        source: Source,
        *,
        host: str = LOOPBACK,
        port: int | None = None,
        mission: Mission | None = None,
        viewer: Mapping[str, Any] | None = None,
    ) -> None:
        viser = _viser()
        self.source, self.host = source, host or LOOPBACK
        viewer = viewer or {}
        frame = source.frame()
        self.display = Display.of(frame, source.looks, source.scenery, viewer, mission)
        self._visitors: dict[int, Visitor] = {}
        self._lock = threading.Lock()
        self._failures = Failures()
        self._own_notes: list[str] = []
        self._period = self._read_period(viewer.get("gui_update_period"))
        self._opening = opening(source.scenery, viewer.get("camera"))
        self._own_notes += self._opening.notes
        self._server = self._start(viser, port)
        self._is_stopped = False
        try:
            self._set_scene(frame)
        except BaseException:
            self._stop_serving()
            raise
        self._server.on_client_connect(self._failures.safe(self._welcome))
        self._server.on_client_disconnect(self._failures.safe(self._farewell))

    def _start(self, viser: Any, port: int | None) -> Any:
        """Viser's server, behind a guard."""
        bound = bound_socket(self.host, port)
        address, self.port = bound.getsockname()[:2]
        self.is_local = ipaddress.ip_address(address).is_loopback
        access = Access(self.host, self.port)
        self.url = access.url
        guard = Guard(bound, access, self._find, self._refuse, self._failures.tell)
        try:
            with guard.in_place(), _silence():
                server = _server_class(viser)(
                    host=self.host, port=self.port, label=f"tussle · {self.source.name}", verbose=False
                )
                if not guard.is_in_place:
                    server.stop()
        except BaseException:
            bound.close()
            raise
        if not guard.is_in_place:
            bound.close()
            raise ViewError("viser did not start its server as expected; without its guard nothing is served")
        return server

    def _set_scene(self, frame: Frame) -> None:
        server, source, display = self._server, self.source, self.display
        gui, scene, looks, blocks = server.gui, server.scene, source.looks, len(source.blocks)
        gui.configure_theme(
            show_share_button=False, show_logo=False, control_width="medium", brand_color=TEAL
        )
        gui.main_panel.dock_right()
        light(scene)
        if source.scenery.background is not None:
            scene.set_background_image(background_image(source.scenery))
        self._set_first_view()
        draw_ground(scene, source.scenery, looks)
        if isinstance(source, Comparison) and source.shift.any():
            scene.add_frame("/beside", show_axes=False, position=tuple(source.shift))
            draw_ground(scene, source.b.scenery, looks, "/beside", has_grid=False)
        safe = self._failures.safe
        panel = Panel(gui, source, display, self.visitor, safe)
        Keyboard(gui, source, panel, self.visitor, safe)
        stage = Stage(scene, blocks, looks, display, self._clicked, safe)
        parts = Parts(
            stage, Labels(scene, display, self.name_of), Trails(scene, source, looks, blocks, display),
            Overlays(scene, looks, blocks, display), Drawn(scene), panel,
        )  # fmt: skip
        stage.show(frame)
        panel.show(frame, 0.0)
        self.pusher = Pusher(server, source, display, parts, self.visitors, self._failures, self._period)

    def _read_period(self, text: Any) -> float:
        """Time between frames as the mission has it, in ms there [s]; 0 where it says nothing of use."""
        try:
            period = 0.0 if text is None else 1e-3 * float(text)
        except ValueError:
            period = -1.0
        if not 0.0 <= period < MOST_PERIOD:
            self._own_notes.append(
                f"gui_update_period {text!r} is no time in ms; frames are sent as fast as can be"
            )
            return 0.0
        return period

    def _set_first_view(self) -> None:
        view, camera = self._opening.view, self._server.initial_camera
        size = self.source.scenery.size
        camera.position, camera.look_at = tuple(view.position), tuple(view.target)
        camera.fov = FIELD_OF_VIEW
        camera.near, camera.far = 1e-4 * size, 100.0 * size

    # -- who watches --------------------------------------------------------------------------------------------------------------

    def _welcome(self, client: Any) -> None:
        visitor = Visitor(client, self.source, self.display, self.name_of, self._failures.safe)
        if self._opening.follow is not None:
            visitor.choose(self._opening.follow)
        visitor.set_mode(self._opening.mode)
        with self._lock:
            self._visitors[client.client_id] = visitor

    def _farewell(self, client: Any) -> None:
        with self._lock:
            self._visitors.pop(client.client_id, None)

    def visitors(self) -> list[Visitor]:
        """Those who watch now."""
        with self._lock:
            return list(self._visitors.values())

    def visitor(self, number: int) -> Visitor | None:
        """One who watches, by the number of its client; None once it is gone."""
        with self._lock:
            return self._visitors.get(number)

    def _clicked(self, number: int, who: int) -> None:
        visitor = self.visitor(number)
        if visitor is not None:
            visitor.choose(who)

    def name_of(self, frame: Frame, row: int) -> str:
        """What to call the entity in a row of a frame: its block's name and its id."""
        if isinstance(self.source, Comparison):
            return self.source.name_of(frame, row)
        return f"{self.source.blocks[int(frame.block[row])]} {int(frame.id[row])}"

    # -- what they send -----------------------------------------------------------------------------------------------------------

    def _visitor_on(self, connection: Any) -> Visitor | None:
        connections = self._server._websock_server._live_connections
        return self.visitor(next((n for n, other in list(connections.items()) if other is connection), -1))

    def _find(self, connection: Any, uuid: str) -> Any:
        """The control with an id, of the shared panel or of a browser's own; None where there is none."""
        visitor = self._visitor_on(connection)
        panels = [self._server.gui] if visitor is None else [self._server.gui, visitor.gui]
        found = (panel._gui_input_handle_from_uuid.get(uuid) for panel in panels)
        return next((control for control in found if control is not None), None)

    def _refuse(self, connection: Any, label: str, reason: str) -> None:
        visitor = self._visitor_on(connection)
        if visitor is not None:
            visitor.refuse(label, reason)

    # -- the server ---------------------------------------------------------------------------------------------------------------

    @property
    def notes(self) -> list[str]:
        """What the user should know, one line each."""
        notes = [*self._own_notes, *self.source.looks.notes, *self.source.scenery.notes, *self.source.notes]
        return list(dict.fromkeys(notes))

    @property
    def error(self) -> BaseException | None:
        """The last thing that failed on the page itself, which goes on; None while nothing has."""
        return self._failures.last

    @property
    def errors(self) -> list[str]:
        """What has failed on the page itself, one line each; they are on the page too."""
        return self._failures.texts

    @property
    def is_live(self) -> bool:
        return isinstance(self.source, Live)

    def stop(self) -> None:
        """Serve no more. A second call does nothing."""
        if not self._is_stopped:
            self._is_stopped = True
            self.pusher.stop()
            self._stop_serving()

    def _stop_serving(self) -> None:
        with _silence():
            self._server.stop()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()


def _viser() -> Any:
    try:
        import viser
    except ImportError as error:
        raise MissingExtraError(
            "the page needs viser, which is not installed: pip install 'tussle[view]'"
            " (tussle export makes pages and films of a recorded run without it)"
        ) from error
    return viser


def _server_class(viser: Any) -> Any:
    class Server(viser.ViserServer):  # type: ignore[misc]
        """viser's server without its tunnel: a message from a browser must not put the game on the internet."""

        def request_share_url(self, verbose: bool = True) -> str | None:
            """Shares nothing."""
            return None

    return Server


@contextlib.contextmanager
def _silence() -> Iterator[None]:
    """Against viser, which prints its address and its end whatever it is told."""
    import rich

    console = rich.get_console()
    before, console.quiet = console.quiet, True
    try:
        yield
    finally:
        console.quiet = before
