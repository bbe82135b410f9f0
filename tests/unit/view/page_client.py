"""Speaks to the page of a live game as a browser does, without drawing."""

from __future__ import annotations

import asyncio
import json
import struct
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module

import numpy as np
from page_reader import read_chunk

from tussle import Mission, Simulation
from tussle.view import Live


class PageClient:
    """A browser without a picture: keeps what the server sends, and orders what is asked for.

    Args:
        url: Of the page.
        is_reading: Take what the server sends; without, it is a browser that hangs.
        is_counting: Count frames, and look into none.

    Attributes:
        status: The last status.
        frame: The last frame: id -> what was seen of it, and its time.
        events: All events, as rows.
        curves: (name, team, id) -> [time, value] of each change.
        results: Names of the results of metrics and interactions.
        refusals: Why values were not taken.
        n_undriven: How often it was told that it may not drive.
        n_frames: Frames that were received.
        n_bytes: All that was received.
        error: Code with which the server closed the socket; None while it is open.
    """

    def __init__(self, url: str, *, is_reading: bool = True, is_counting: bool = False) -> None:
        self.status: dict = {}
        self.frame: dict = {}
        self.t = float("nan")
        self.events: list = []
        self.curves: dict = {}
        self.results: list[str] = []
        self.refusals: list[str] = []
        self.drawn: dict = {}
        self.past: list = []
        self.n_frames = self.n_bytes = self.n_undriven = 0
        self.error: int | None = None
        self._url, self._is_reading, self._is_counting = url, is_reading, is_counting
        self._is_open = threading.Event()
        self._refused: Exception | None = None
        self._thread = threading.Thread(target=lambda: asyncio.run(self._run()), daemon=True)
        self._thread.start()
        self._is_open.wait()
        if self._refused:
            raise self._refused

    async def _run(self) -> None:
        aiohttp = import_module("aiohttp")
        self._loop, self._task = asyncio.get_running_loop(), asyncio.current_task()
        try:
            async with aiohttp.ClientSession() as session:
                timeout = aiohttp.ClientWSTimeout(ws_close=0.5)
                async with session.ws_connect(self._url, max_msg_size=0, timeout=timeout) as self._socket:
                    self._is_open.set()
                    if not self._is_reading:
                        await asyncio.Event().wait()
                    async for message in self._socket:
                        self._take(message.data)
                    self.error = self._socket.close_code
        except aiohttp.ClientError as error:
            self._refused = error
        except asyncio.CancelledError:
            pass
        finally:
            self._is_open.set()

    def _take(self, data: str | bytes) -> None:
        self.n_bytes += len(data)
        if self._is_counting:
            self.n_frames += not isinstance(data, str)
            return
        if isinstance(data, str):
            message = json.loads(data)
            if message["kind"] == "curves":
                self._take_curves(message)
                return
            self.status = message
            events = self.status["events"]
            self.events[events["from"] :] = events["rows"]
            self.refusals += [self.status["refusal"]] if self.status["refusal"] else []
            self.n_undriven += self.status["isDriveRefused"]
            return
        (length,) = struct.unpack_from("<I", data)
        header, body = json.loads(data[4 : 4 + length]), data[4 + length :]
        if header["kind"] == "drawn":
            self.drawn = header
        else:
            chunk = read_chunk(body)
            if header["kind"] == "past":
                self.past.append((header["seconds"], chunk))
            else:
                self.frame, self.t = chunk.frames[-1], float(chunk.t[-1])
                self.n_frames += 1

    def _take_curves(self, message: dict) -> None:
        self.results = message["results"]
        for change in message["changes"]:
            curve = self.curves.setdefault((change["name"], change["team"], change["id"]), [])
            curve[change["from"] :] = [list(pair) for pair in zip(change["t"], change["v"], strict=True)]

    # -- what somebody does -----------------------------------------------------------------------------------------------------------

    def send(self, text: str | bytes) -> None:
        """Send anything."""
        send = self._socket.send_bytes if isinstance(text, bytes) else self._socket.send_str
        asyncio.run_coroutine_threadsafe(send(text), self._loop).result(60)

    def order(self, do: str, **fields) -> None:
        """Send a command."""
        self.send(json.dumps({"do": do, **fields}))

    def wait(self, condition, timeout: float = 300.0):
        """Wait until it holds, and return what it gave."""
        until = time.monotonic() + timeout
        while not (given := condition()):
            assert time.monotonic() < until, "it does not come"
            time.sleep(0.01)
        return given

    def says(self, part: str) -> bool:
        """Whether one of the notes on the page has this part."""
        return any(part in note for note in self.status.get("notes", ()))

    @property
    def positions(self) -> np.ndarray:
        """Where the entities are drawn [m], (n, 3), by their ids."""
        return np.array([self.frame[who].pos for who in sorted(self.frame)])

    def close(self) -> None:
        """Go away."""
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._task.cancel)
            self._thread.join(300)

    def __enter__(self):
        return self

    def __exit__(self, *_) -> None:
        self.close()


@contextmanager
def browsed(mission: Mission, seed: int, **options: object) -> Iterator[tuple[Live, object, PageClient]]:
    """A game with options of `Live`, its page, and a browser at it."""
    from tussle.view.page.server import Page

    with (
        Simulation(mission, seed) as simulation, Live(simulation, **options) as live,
        Page(live) as page, PageClient(page.url) as client,
    ):  # fmt: skip
        yield live, page, client
