"""Serves a simulation by websocket: JSON objects, one a message."""

from __future__ import annotations

import asyncio
import json
import math
import time
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, Self, TypeVar

from tussle.documents import Whole, check_argument
from tussle.engine.simulation import Simulation
from tussle.errors import MissingExtraError, ParameterError, TussleError, listed, nearest_name
from tussle.pacing import Pace
from tussle.view.pacing import checked_warp
from tussle.view.page.access import MAX_BROWSERS, Access, bound_socket
from tussle.view.page.web_server import WebServer
from tussle.view.serve.session import ENCODINGS, Session, as_json, encoded

if TYPE_CHECKING:
    from aiohttp import web

T = TypeVar("T")

MAX_BYTES = 64 * 1024 * 1024
"""Largest size of a message from a client [B]."""
MAX_WAITING = 64
"""Length of a client's queue of messages; further states are dropped."""
MAX_SUBSCRIPTIONS = 64
"""Largest number of subscriptions of a client."""
SLICE = 0.05
"""Longest run of steps before other commands are executed [s]."""
COUNT = Whole(1, 10**9)
OWN_COMMANDS = ("pause", "play", "step", "subscribe", "unsubscribe")


@dataclass(frozen=True)
class Subscription:
    """Columns that a client gets after every so many steps."""

    paths: tuple[str, ...]
    every: int
    encoding: str


class Client:
    """A connected program.

    Attributes:
        subscriptions: Number of a subscription -> what it wants.
        n_dropped: States that were not sent since the last one that was.
    """

    def __init__(self, socket: web.WebSocketResponse) -> None:
        self.socket = socket
        self.subscriptions: dict[int, Subscription] = {}
        self.waiting: asyncio.Queue[str] = asyncio.Queue(MAX_WAITING)
        self.n_dropped = 0

    def offer(self, state: dict[str, Any]) -> None:
        """Send a state, unless too many messages wait."""
        if self.waiting.full():
            self.n_dropped += 1
            return
        self.waiting.put_nowait(as_json(state | {"dropped": self.n_dropped}))
        self.n_dropped = 0


class Server:
    """Serves a simulation from construction until `stop`, in threads of its own.

    Only who has the whole address is served, and no page of a browser. All clients share the simulation; commands are executed one
    after another.

    Args:
        simulation: The simulation; nobody else may step it.
        host: Address that it is served at; others than the loopback's can be reached from other machines.
        port: Its port; None takes the first free one from 8123 on.

    Attributes:
        url: The address for websockets, with its token.

    Raises:
        MissingExtraError: aiohttp is not installed.
        ViewError: It cannot be served there.
    """

    def __init__(self, simulation: Simulation, *, host: str = "127.0.0.1", port: int | None = None) -> None:
        try:
            import aiohttp  # noqa: F401
        except ImportError as error:
            raise MissingExtraError("tussle.serve needs aiohttp: pip install 'tussle[serve]'") from error
        self._simulation, self._session = simulation, Session(simulation)
        self._clients: list[Client] = []
        self._n_subscriptions = self._n_steps = 0
        self._pace: Pace | None = None
        self._executor = ThreadPoolExecutor(1, "tussle serve")
        self._bound = bound_socket(host, port)
        self._access = Access(host, self._bound.getsockname()[1])
        self.url = self._access.url.replace("http", "ws", 1)
        self._turn, self._can_play = asyncio.Lock(), asyncio.Event()
        try:
            self._server = WebServer(
                self._bound, self._admit, "tussle serve", beside=[self._play], before_end=self._close_clients
            )
        except BaseException:
            self._executor.shutdown()
            raise

    def stop(self) -> None:
        """Stop serving; the simulation stays. A second call does nothing."""
        self._server.stop()
        self._executor.shutdown()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    # -- the server ---------------------------------------------------------------------------------------------------------------

    async def _close_clients(self) -> None:
        for client in list(self._clients):
            await client.socket.close()

    async def _admit(self, request: web.Request) -> web.StreamResponse:
        from aiohttp import web

        headers = request.headers
        reason = self._access.refusal(
            request.raw_path, headers.getall("Host", []), headers.getall("Origin", [])
        )
        if not reason and "Origin" in headers:
            reason = "This is not open to pages.\n"
        if not reason and len(self._clients) >= MAX_BROWSERS:
            reason = f"{MAX_BROWSERS} programs are connected already.\n"
        if reason:
            return web.Response(status=403, text=reason)
        if "Upgrade" not in headers:
            return web.Response(status=426, text=f"Connect a websocket to {self.url}\n")
        socket = web.WebSocketResponse(max_msg_size=MAX_BYTES, compress=False, timeout=1.0)
        await socket.prepare(request)
        client = Client(socket)
        self._clients.append(client)
        sender = asyncio.create_task(self._send(client))

        def is_gone() -> bool:
            return request.transport is None or request.transport.is_closing()

        try:
            async for message in socket:
                await client.waiting.put(as_json(await self._answer(client, message.data, is_gone)))
        finally:
            self._clients.remove(client)
            sender.cancel()
        return socket

    async def _send(self, client: Client) -> None:
        while True:
            text = await client.waiting.get()
            # A program that is gone gets nothing, but its queue is emptied: `_admit` waits for a place in it, and then leaves.
            with suppress(ConnectionError):
                await client.socket.send_str(text)

    # -- commands -------------------------------------------------------------------------------------------------------------------

    async def _answer(self, client: Client, text: Any, is_gone: Callable[[], bool]) -> dict[str, Any]:
        """Execute a command and return its answer."""
        answer: dict[str, Any] = {}
        try:
            if not isinstance(text, str):
                raise ParameterError("the message is binary; a message is a text with an object of JSON")
            fields = json.loads(text)
            if not isinstance(fields, dict):
                raise ParameterError('a message is an object, such as {"do": "step", "n": 10, "id": 1}')
            if "id" in fields:
                answer["id"] = fields.pop("id")
            answer |= await self._do(client, fields.pop("do", None), fields, is_gone)
        except TussleError as error:
            answer["error"] = str(error)
        except (ValueError, RecursionError) as error:
            answer["error"] = f"the message is no JSON: {error}"
        except Exception as error:  # noqa: BLE001 - of whatever a plugin does: the client reads it, and the server goes on
            answer["error"] = f"{type(error).__name__}: {error}"
        return answer

    async def _do(
        self, client: Client, command: Any, fields: dict[str, Any], is_gone: Callable[[], bool]
    ) -> dict[str, Any]:
        if command == "step":
            return await self._step(is_gone, **_known(command, fields, n=1))
        if command == "play":
            self._pace = Pace(checked_warp(_known(command, fields, pace=1.0)["pace"], "pace"))
            self._can_play.set()
            return {}
        if command == "pause":
            _known(command, fields)
            self._can_play.clear()
            return await self._turned(self._session.now)
        if command == "subscribe":
            return await self._turned(
                lambda: self._subscribe(client, **_known(command, fields, paths=[], every=1, encoding="list"))
            )
        if command == "unsubscribe":
            number = _known(command, fields, subscription=0)["subscription"]
            if not isinstance(number, int) or client.subscriptions.pop(number, None) is None:
                raise ParameterError(
                    f"there is no subscription {number!r}; {listed(map(str, client.subscriptions))}"
                )
            return {}
        if not isinstance(command, str) or command not in self._session.commands():
            names = sorted([*OWN_COMMANDS, *self._session.commands()])
            raise ParameterError(
                f"do = {command!r} is not allowed{nearest_name(str(command), names)}; {listed(names)}"
            )
        return await self._turned(lambda: self._session.call(command, fields))

    async def _turned(self, function: Callable[[], T]) -> T:
        """Call a function between two steps, in the thread of the simulation."""
        async with self._turn:
            return await asyncio.get_running_loop().run_in_executor(self._executor, function)

    def _subscribe(self, client: Client, paths: Any, every: int, encoding: str) -> dict[str, Any]:
        wanted = tuple(paths) if isinstance(paths, list) else (paths,)
        if not wanted or len(client.subscriptions) >= MAX_SUBSCRIPTIONS:
            raise ParameterError(
                f"a client has 1 to {MAX_SUBSCRIPTIONS} subscriptions, each of at least one path"
            )
        check_argument("every", every, COUNT)
        if encoding not in ENCODINGS:
            raise ParameterError(f"encoding = {encoding!r} is not allowed; {listed(ENCODINGS)}")
        for path in wanted:
            self._simulation.read(path)
        self._n_subscriptions += 1
        client.subscriptions[self._n_subscriptions] = Subscription(wanted, every, encoding)
        return {"subscription": self._n_subscriptions}

    # -- steps ------------------------------------------------------------------------------------------------------------------------

    async def _step(self, is_gone: Callable[[], bool], n: int) -> dict[str, Any]:
        check_argument("n", n, COUNT)
        # A client that is gone does not step the game of others.
        while n > 0 and not (self._simulation.is_over or is_gone()):
            n -= await self._turned(partial(self._advance, n))
        return self._session.now()

    def _advance(self, n: int) -> int:
        """Make up to n steps, for a limited time; return how many."""
        until = time.perf_counter() + SLICE
        made = 0
        while made < n:
            made += 1
            self._simulation.step()
            self._n_steps += 1
            self._inform()
            if time.perf_counter() > until or self._simulation.is_over:
                break
        return made

    def _inform(self) -> None:
        """Send the columns that are due to those who subscribed to them."""
        for client in list(self._clients):
            for number, wanted in list(client.subscriptions.items()):
                if self._n_steps % wanted.every == 0:
                    columns = {
                        path: encoded(self._simulation.read(path)[0], wanted.encoding)
                        for path in wanted.paths
                    }
                    state = {"subscription": number, **self._session.now(), "columns": columns}
                    self._loop.call_soon_threadsafe(client.offer, state)

    async def _play(self) -> None:
        """Make steps while the game is not paused."""
        self._loop = asyncio.get_running_loop()
        while True:
            await self._can_play.wait()
            pace, simulation = self._pace, self._simulation
            assert pace is not None
            left = pace.wait(float(simulation.t[0]), simulation.mission.dt)
            if left > 0.0:
                await asyncio.sleep(min(left, SLICE))
                continue
            try:
                await self._turned(partial(self._advance, 10**9 if math.isinf(pace.warp) else 1))
            except Exception as error:  # noqa: BLE001 - of a plugin; clients read it
                self._can_play.clear()
                for client in self._clients:
                    client.offer({"error": str(error)})
            if simulation.is_over:
                self._can_play.clear()


def _known(command: str, fields: Mapping[str, Any], **defaults: Any) -> dict[str, Any]:
    """The fields of a command, with defaults.

    Raises:
        ParameterError: A field is not known.
    """
    for name in fields:
        if name not in defaults:
            raise ParameterError(
                f"{command} has no field {name!r}{nearest_name(name, defaults)}; {listed(defaults)}"
            )
    return {**defaults, **fields}
