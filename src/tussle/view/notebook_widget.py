"""Views of `tussle.view.notebook` that need anywidget and the kernel of the notebook."""

from __future__ import annotations

import asyncio
import threading
from dataclasses import dataclass
from functools import cache
from html import escape
from typing import Any

from tussle.view.live import Live
from tussle.view.page.access import MAX_BROWSERS, MAX_BYTES, PageRole
from tussle.view.page.assemble import FRAMED, page_html, web_text
from tussle.view.page.document import game_document, scenery_blobs
from tussle.view.page.failures import Failures
from tussle.view.page.publisher import PERIOD, FramePublisher
from tussle.view.page.recorded import RecordedData

NEEDS_KERNEL = "This 3D view needs its kernel: run the cell again."


@cache
def _widget_class() -> Any:
    """Return the class of widgets, whose base class is in a package of an extra."""
    import anywidget
    import traitlets

    class PageWidget(anywidget.AnyWidget):  # type: ignore[misc, unused-ignore]
        """The page in a cell."""

        _esm = web_text("widget.js")
        html = traitlets.Unicode().tag(sync=True)
        height = traitlets.Int().tag(sync=True)

    return PageWidget


class _KernelView:
    """A page in a cell, and what it asks the kernel for.

    Args:
        html: The page.
        height: Height of the view [pixels].

    Attributes:
        widget: What notebooks show; it may be put into a layout of ipywidgets.
    """

    def __init__(self, html: str, height: int) -> None:
        self._failures = Failures()
        self.widget = _widget_class()(html=html, height=height)
        self.widget.on_msg(self._receive)

    def _repr_mimebundle_(self, **options: Any) -> Any:
        shown = self.widget._repr_mimebundle_(**options)
        # What programs show that have no widgets, such as a converted notebook.
        data = shown[0] if isinstance(shown, tuple) else shown
        if data is not None:
            data |= {"text/plain": NEEDS_KERNEL, "text/html": f"<p>{escape(NEEDS_KERNEL)}</p>"}
        return shown

    def _display_(self) -> Any:
        """Return what marimo shows."""
        return self.widget

    def _receive(self, _: object, content: Any, buffers: object) -> None:
        if isinstance(content, dict) and isinstance(content.get("view"), str):
            with self._failures.caught():
                self._take(content["view"], content)

    def _take(self, view: str, content: dict[str, Any]) -> None:
        """Answer a message of a cell that shows the page."""
        if content.get("do") != "blob":
            return
        name = str(content.get("name"))
        answer: dict[str, Any] = {"do": "blob", "view": view, "name": name}
        try:
            data = self._blob(name)
            if data is None:
                answer["error"] = "There is nothing of this name."
        except Exception as error:  # noqa: BLE001 - whatever it is, whoever watches reads it, and the page goes on
            data, answer["error"] = None, self._failures.tell(error)
        self.widget.send(answer, [] if data is None else [data])

    def _blob(self, name: str) -> bytes | None:
        return None


class RunView(_KernelView):
    """A recorded run that is too large for a cell.

    Args:
        data: Its data.
        height: Height of the view [pixels].
    """

    def __init__(self, data: RecordedData, height: int) -> None:
        self._data = data
        super().__init__(page_html(data.document(source="framed"), entry=FRAMED), height)

    def _blob(self, name: str) -> bytes | None:
        return self._data.blob(name)


class GameView(_KernelView):
    """A simulation that is played in a cell.

    Args:
        live: The game.
        height: Height of the view [pixels].

    Attributes:
        live: Controls of the game.
    """

    def __init__(self, live: Live, height: int) -> None:
        self.live = live
        failures = Failures()
        self._publisher = FramePublisher(live, failures, PERIOD, one_steers=False)
        self._scenery = scenery_blobs(live.scenery)
        self._cells: dict[str, _Cell] = {}
        document = game_document(live, live.simulation.mission, live.viewer) | self._publisher.document()
        super().__init__(page_html(document | {"source": "framedLive"}, entry=FRAMED), height)
        self._failures = failures
        self._loop = _loop_of_kernel()
        self._running = asyncio.run_coroutine_threadsafe(self._publisher.run(), self._loop)

    def _blob(self, name: str) -> bytes | None:
        return self._scenery.get(name)

    def _take(self, view: str, content: dict[str, Any]) -> None:
        super()._take(view, content)
        do, cell, text = content.get("do"), self._cells.get(view), content.get("text")
        if do == "watch" and cell is None and len(self._cells) < MAX_BROWSERS:
            cell = self._cells[view] = _Cell(self.widget, view)
            asyncio.run_coroutine_threadsafe(self._publisher.serve(cell, PageRole()), self._loop)
        elif cell is not None and do == "taken":
            self._loop.call_soon_threadsafe(cell.taken.set)
        elif cell is not None and do == "command" and isinstance(text, str) and len(text) <= MAX_BYTES:
            self._loop.call_soon_threadsafe(cell.received.put_nowait, text)
        elif cell is not None and do == "leave":
            del self._cells[view]
            self._loop.call_soon_threadsafe(cell.leave)

    def stop(self) -> None:
        """End the game and release the simulation. A second call does nothing."""
        for view, cell in list(self._cells.items()):
            self.widget.send({"do": "lost", "view": view})
            self._loop.call_soon_threadsafe(cell.leave)
        self._cells.clear()
        self._running.cancel()
        self.live.stop()


def _loop_of_kernel() -> asyncio.AbstractEventLoop:
    """Return the event loop of the kernel, whose messages only its own thread may send; without one, a new loop in a thread."""
    try:
        return asyncio.get_running_loop()
    except RuntimeError:
        loop = asyncio.new_event_loop()
        threading.Thread(target=loop.run_forever, name="tussle notebook", daemon=True).start()
        return loop


@dataclass(frozen=True)
class _Received:
    """A message of a cell, as a websocket gives it; None at its end."""

    data: str | None


class _Cell:
    """A cell that shows a game: what `FramePublisher` needs of a websocket. One message is under way at a time.

    Args:
        widget: What sends to the cell.
        view: Name of the cell.
    """

    def __init__(self, widget: Any, view: str) -> None:
        self._widget, self._view = widget, view
        self.closed = False
        self.received: asyncio.Queue[str | None] = asyncio.Queue()
        self.taken = asyncio.Event()
        self.taken.set()

    def leave(self) -> None:
        """The cell shows the game no longer."""
        self.closed = True
        self.received.put_nowait(None)

    async def receive(self) -> _Received:
        return _Received(await self.received.get())

    async def send_str(self, data: str) -> None:
        await self._send({"text": data}, [])

    async def send_bytes(self, data: bytes) -> None:
        await self._send({}, [data])

    async def _send(self, content: dict[str, Any], buffers: list[bytes]) -> None:
        await self.taken.wait()
        self.taken.clear()
        self._widget.send({"do": "game", "view": self._view, **content}, buffers)
