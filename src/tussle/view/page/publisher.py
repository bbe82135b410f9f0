"""Sends a live game to the connected browsers and executes their commands."""

from __future__ import annotations

import asyncio
import json
import math
import time
from bisect import bisect_right
from collections import deque
from collections.abc import Callable
from dataclasses import asdict
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from tussle.documents import Real
from tussle.errors import ParameterError
from tussle.pacing import POLL_PERIOD
from tussle.record.inputs import given_by
from tussle.record.run_file import mission_entry
from tussle.view.curves import numbers_of
from tussle.view.frame import Event, Frame
from tussle.view.live import Live
from tussle.view.page.access import DIRECT, OPERATE, WATCH, PageRole
from tussle.view.page.chunks import FULL_HEALTH, UNIT, pack, step_of
from tussle.view.page.commands import ID, IDS, MAX_ID, STICKS, WANTED, Command, game_commands, read_command
from tussle.view.page.document import event_rows
from tussle.view.page.drawing import drawing_message
from tussle.view.page.failures import Failures
from tussle.view.page.formatting import entity_sections, feed_rows, mission_facts, result_rows
from tussle.view.page.packing import message
from tussle.view.page.seen import SeenGame
from tussle.view.series import OF_TEAMS, Changes, CurveName, StepSeries


class Socket(Protocol):
    """A connection to a browser: aiohttp's websocket, or a cell of a notebook."""

    @property
    def closed(self) -> bool: ...
    async def receive(self) -> Any: ...
    async def send_str(self, data: str) -> None: ...
    async def send_bytes(self, data: bytes) -> None: ...


PERIOD = 1.0 / 30.0
"""Least time between two frames [s]."""
STATUS_PERIOD = 0.25
"""Period at which numbers, notes, events and the chosen entity are sent [s]."""
MAX_MESSAGES = 200
"""Largest number of messages per second that are read from one browser; further ones wait."""
TOO_MANY = f"this page sends more than {MAX_MESSAGES} messages a second; the further ones wait"
MAX_EVENTS = 2000
"""Largest number of events in one message."""
MAX_CHANGES = 5000
"""Number of changes at which a message is full; those of one quantity are sent together."""
DRIVE_LEASE = 10.0
"""Time after which an entity is given back if its driver's browser, which repeats its sticks each second, is silent [s]."""
REFUSAL_PERIOD = 1.0
"""Least time between two messages about refused values [s]."""
PAST_FRAMES, PAST_STATES = 120, 60_000
"""Limits of the history that a browser asks for: frames, and states of entities in them."""
MAX_LOOKS = 4
"""Back, that wait to be sent to a browser."""


class Reader:
    """A connected browser.

    Attributes:
        socket: Its websocket.
        role: What it may do.
        chosen: Id of the entity whose state it reads; 0 for nobody.
        has_feed: It reads the messages of the game.
        driven: Id of the entity that it drives; 0 for none.
        sticks: Those that it has sent last, and when.
        wake: There is something to be sent.
    """

    def __init__(self, socket: Socket, role: PageRole) -> None:
        self.socket, self.role = socket, role
        self.chosen = 0
        self.has_feed = False
        self.driven = 0
        self.sticks: tuple[list[float], float] = [], 0.0
        self.wake = asyncio.Event()
        self.wake.set()
        self.frame_sent = self.drawn_sent = 0
        self.status_due = 0.0
        self.is_due = False
        self.past: deque[bytes] = deque(maxlen=MAX_LOOKS)
        self.refusal: str | None = None
        self.is_drive_refused = False
        self.refused_at = -REFUSAL_PERIOD
        self.events_sent: list[Event] = []
        self.wanted: frozenset[tuple[str, int]] = frozenset()
        self.changes_sent: dict[CurveName, tuple[StepSeries, int]] = {}
        self.results_sent: list[str] = []
        self.free_at = 0.0

    def choose(self, id: int) -> None:  # noqa: A002 - as the page calls it
        """Select the entity whose state is sent; 0 selects none."""
        self.chosen = id

    def listen(self, is_on: bool) -> None:
        """Send the messages of the game, or no more."""
        self.has_feed = is_on


class FramePublisher:
    """Encodes each frame once for all browsers. A browser gets the newest frame after it has read the previous one.

    While nobody watches, the game is asked for nothing, unless it is seen late. All methods but
    `n_readers` are called in the server's loop.

    Args:
        live: The game.
        failures: Told of what fails.
        period: Time between two frames [s], no less than `PERIOD`.
        one_steers: Only the browser that came first, of those that watch, may steer.

    Attributes:
        readers: Those who watch now, in the order in which they came.
        n_made: Frames that were made.
    """

    def __init__(self, live: Live, failures: Failures, period: float, one_steers: bool) -> None:
        self._live, self._failures, self._one_steers = live, failures, one_steers
        self._period = max(period, PERIOD)
        self.readers: list[Reader] = []
        self.n_made = 0
        self._moments: deque[float] = deque(maxlen=64)
        self._seen = SeenGame(live)
        self._packed: tuple[Frame, int] | None = None
        self._frame = self._drawn = b""
        self._shapes: tuple[Any, ...] = ()
        self._n_drawn = 0
        self._drawing_notes: list[str] = []
        self._commands = game_commands(live)

    def document(self) -> dict[str, Any]:
        """Return the document of a live game."""
        mission = self._live.simulation.mission
        facts = [("Seed", str(self._live.seed)), *mission_facts(mission_entry(mission), self._live.teams)]
        return {
            "source": "socket", "facts": facts, "endTime": mission.end if self._ends_by_time else None, "dt": mission.dt,
            "idShift": 0, "isComplete": True, "attitudeUnit": UNIT,
            "healthSteps": FULL_HEALTH, "seed": min(self._live.seed, MAX_ID),
        }  # fmt: skip

    @property
    def _ends_by_time(self) -> bool:
        mission = self._live.simulation.mission
        return "time" in mission.end_conditions and math.isfinite(mission.end)

    @cached_property
    def _step(self) -> float:
        scenery, style = self._live.scenery, self._live.style
        smallest = min((style.scale(i) for i in range(len(self._live.blocks))), default=1.0)
        return step_of(scenery.low, scenery.high, smallest)

    async def run(self) -> None:
        """Make frames while at least one browser is connected, or while the game is seen late."""
        while True:
            is_needed = bool(self.readers) or self._live.see > 0.0
            if is_needed:
                with self._failures.caught():
                    self._end_leases()
                    self._look()
                    self._make_frame()
                with self._failures.caught():
                    self._make_drawing()
                for reader in self.readers:
                    reader.wake.set()
            await asyncio.sleep(self._period if is_needed else POLL_PERIOD)

    def _look(self) -> None:
        """Read the game, with details where they are to be sent now."""
        for reader in self.readers:
            reader.is_due = reader.is_due or time.monotonic() >= reader.status_due
        self._seen.look(
            {reader.chosen for reader in self.readers if reader.chosen},
            has_feed=any(reader.has_feed for reader in self.readers),
            has_details=any(reader.is_due for reader in self.readers),
        )

    def _make_frame(self) -> None:
        frame, epoch = self._seen.now.frame, self._seen.now.epoch
        if self._packed is None or frame is not self._packed[0] or epoch != self._packed[1]:
            self._packed = frame, epoch
            self._frame = message({"kind": "frame", "epoch": epoch}, pack(frame.step, [frame], self._step))
            self.n_made += 1
            self._moments.append(time.monotonic())

    def _make_drawing(self) -> None:
        shapes = self._seen.now.shapes
        if len(shapes) == len(self._shapes) and all(
            a is b for a, b in zip(shapes, self._shapes, strict=True)
        ):
            return
        self._shapes = shapes
        header, data, notes = drawing_message(shapes)
        self._drawing_notes += [note for note in notes if note not in self._drawing_notes]
        self._drawn = message({"kind": "drawn", **header}, data)
        self._n_drawn += 1

    # -- one browser ----------------------------------------------------------------------------------------------------------------

    async def serve(self, socket: Socket, role: PageRole) -> None:
        """Send to a browser and take what it sends, until it goes. Its orders are recorded as given by its role."""
        reader = Reader(socket, role)
        with given_by(str(role)):
            await self._serve(reader, socket)

    async def _serve(self, reader: Reader, socket: Socket) -> None:
        """Send and take."""
        self.readers.append(reader)
        with self._failures.caught():
            self._look()
        sender = asyncio.create_task(self._send(reader))
        try:
            while not socket.closed:
                now = time.monotonic()
                reader.free_at = max(reader.free_at, now - 1.0) + 1.0 / MAX_MESSAGES
                if reader.free_at > now:
                    self._refuse(reader, TOO_MANY)
                    await asyncio.sleep(reader.free_at - now)
                received = await socket.receive()
                if received.data is None or socket.closed:
                    break
                self._take(reader, received.data)
        finally:
            self.readers.remove(reader)
            sender.cancel()
            self._drive(reader, [], None)
            if reader.wanted:
                self._watch()

    async def _send(self, reader: Reader) -> None:
        """Send what is new. A browser that takes nothing is waited for here, and misses what is made meanwhile."""
        socket = reader.socket
        try:
            while True:
                await reader.wake.wait()
                reader.wake.clear()
                if reader.is_due:
                    reader.is_due = False
                    reader.status_due = time.monotonic() + STATUS_PERIOD
                    await self._send_document(socket, lambda: self._status(reader))
                while reader.past:
                    await socket.send_bytes(reader.past.popleft())
                if reader.drawn_sent != self._n_drawn:
                    reader.drawn_sent = self._n_drawn
                    await socket.send_bytes(self._drawn)
                # Before the frame: the page has the counts of what it shows.
                await self._send_document(socket, lambda: self._new_curves(reader))
                if reader.frame_sent != self.n_made:
                    reader.frame_sent = self.n_made
                    await socket.send_bytes(self._frame)
        except (ConnectionError, RuntimeError):  # it has gone; `serve` hears of it too
            return

    async def _send_document(self, socket: Socket, make: Callable[[], dict[str, Any] | None]) -> None:
        """Make a document and send it. That a browser has gone is no failure of the page; one while it is made is."""
        text = ""
        with self._failures.caught():
            if document := make():
                text = json.dumps(document)
        if text:
            await socket.send_str(text)

    def _status(self, reader: Reader) -> dict[str, Any]:
        live, seen = self._live, self._seen.now
        result = seen.details.result
        refusal, reader.refusal = reader.refusal, None
        is_drive_refused, reader.is_drive_refused = reader.is_drive_refused, False
        warp = live.warp
        error = live.error
        now = time.monotonic()
        return {
            "kind": "status", "t": seen.t, "step": seen.step, "span": seen.span, "epoch": seen.epoch, "seed": live.seed,
            "isPaused": live.is_paused, "isOver": seen.is_over, "isSeeking": live.is_seeking,
            "warp": None if math.isinf(warp) else warp, "reached": live.warp_reached,
            "rate": sum(now - moment <= 1.0 for moment in self._moments),
            "notes": [*live.notes, *self._drawing_notes, *self._failures.texts], "error": None if error is None else str(error),
            "metrics": [] if result is None else result_rows(result, live.teams), "events": self._new_events(reader),
            "entity": self._entity(reader), "refusal": refusal, "isDriveRefused": is_drive_refused, "steers": self._may_steer(reader),
            "role": asdict(reader.role),
            "feed": feed_rows(seen.details.feed) if reader.has_feed else None,
            "alarms": [
                {k: None if isinstance(v, float) and not math.isfinite(v) else v for k, v in asdict(each).items()}
                for each in seen.details.alarms
            ],
        }  # fmt: skip

    def _new_events(self, reader: Reader) -> dict[str, Any]:
        """Return the events that a browser does not have yet, and how many of the earlier ones are still valid."""
        events, sent = self._seen.events(), reader.events_sent
        n = len(sent)
        if events[:n] != sent:  # an alarm is older than what came after it, for example
            pairs = enumerate(zip(events, sent, strict=False))
            n = next((i for i, (one, other) in pairs if one != other), min(len(events), n))
        new = events[n : n + MAX_EVENTS]
        reader.events_sent = events[: n + len(new)]
        return {"from": n, "rows": event_rows(new)}

    def _new_curves(self, reader: Reader) -> dict[str, Any] | None:
        """Return the changes that a browser does not have yet, of the quantities that it wants, and the names of all results."""
        robustness = self._live.robustness
        series = self._live.curves.series | robustness
        results = sorted({q.name for q in series if not q.id and q.name not in OF_TEAMS})
        has_names = results != reader.results_sent
        reader.results_sent = results
        changes: list[Changes] = []
        for quantity, each in series.items():
            is_shown = quantity.name in OF_TEAMS or quantity in robustness
            if not is_shown and (quantity.name, quantity.id) not in reader.wanted:
                continue
            sent, n_sent = reader.changes_sent.get(quantity, (None, 0))
            start = n_sent if sent is each else 0
            end = max(start, bisect_right(each.steps, self._seen.last_step()))
            if (start == end and sent is each) or sum(len(c.t) for c in changes) > MAX_CHANGES:
                continue
            reader.changes_sent[quantity] = each, end
            t = [self._live.time_of(step) for step in each.steps[start:end]]
            changes.append(Changes(quantity, start, t, each.values[start:end]))
        if not changes and not has_names:
            return None
        return {"kind": "curves", "results": results, "changes": [each.document() for each in changes]}

    def _want(self, reader: Reader, wanted: list[tuple[str, int]]) -> None:
        """Send these results (id 0) and columns of entities to a browser."""
        reader.wanted = frozenset((name, who) for name, who in wanted)
        reader.changes_sent = {
            q: sent
            for q, sent in reader.changes_sent.items()
            if (q.name, q.id) in reader.wanted or q.name in OF_TEAMS
        }
        self._watch()

    def _watch(self) -> None:
        self._live.watch(
            {CurveName(name, None, who) for each in self.readers for name, who in each.wanted if who}
        )

    def _entity(self, reader: Reader) -> dict[str, Any] | None:
        who, seen = reader.chosen, self._seen.now.details.entities
        state = seen.get(who) or self._live.entity(who) if who else None
        if state is None:
            return None
        quantities = [[name, unit] for name, (_, unit) in numbers_of(state).items()]
        orders = [asdict(kind) for kind in state.orders]
        return {
            "id": state.id,
            # Of one that was chosen after what is seen now, only what does not change.
            "sections": entity_sections(state) if seen.get(who) or not self._seen.is_late else [],
            "quantities": quantities,
            "orders": orders,
            "axes": state.axes,
            "isDriven": state.is_driven,
        }

    # -- what they send ---------------------------------------------------------------------------------------------------------------

    def _may_steer(self, reader: Reader) -> bool:
        """Whether a browser may do everything: of those of this role, where one steers the first."""
        steering = [each for each in self.readers if each.role.kind == DIRECT]
        return reader in (steering[:1] if self._one_steers else steering)

    def _check_role(self, reader: Reader, command: Command, given: dict[str, Any]) -> None:
        """Refuse a command that a browser may not give.

        Raises:
            ParameterError: It is for another role, or for an entity of another team.
        """
        if not command.steers or self._may_steer(reader):
            return
        role = reader.role
        if role.kind != OPERATE:
            raise ParameterError(
                "this address is for watching" if role.kind == WATCH else "another browser steers this game"
            )
        if not command.receivers:
            raise ParameterError(f"this address is for orders to team {role.team}")
        frame = self._live.frame()
        team = dict(zip(frame.id.tolist(), frame.team.tolist(), strict=True))
        for who in given[command.receivers]:
            if team.get(who) != role.team:
                raise ParameterError(
                    f"entity {who} is not of team {role.team}, to which this address gives orders"
                )

    def _take(self, reader: Reader, text: Any) -> None:
        """Execute the command of a browser; ignore invalid ones."""
        commands = self._commands | {
            "choose": Command(reader.choose, {"id": ID}, steers=False),
            "listen": Command(reader.listen, {"is_on": bool}, steers=False),
            "want": Command(lambda wanted: self._want(reader, wanted), {"wanted": WANTED}, steers=False),
            "drive": Command(
                lambda entities, sticks: self._drive(reader, entities, sticks),
                {"entities": IDS, "sticks": STICKS},
                receivers="entities",
            ),
            "history": Command(
                lambda seconds: self._look_back(reader, seconds), {"seconds": Real(0.0, 1e9)}, steers=False
            ),
        }
        with self._failures.caught():
            name = ""
            try:
                read = read_command(text, commands)
                if read is None:
                    return
                name, given = read
                self._check_role(reader, commands[name], given)
                commands[name].do(**given)
            except ParameterError as error:
                self._refuse(reader, str(error))
                reader.is_drive_refused |= name == "drive"
            for each in self.readers:
                each.status_due = 0.0

    def _drive(self, reader: Reader, entities: list[int], sticks: list[float] | None) -> None:
        """Drive an entity, the only one of a browser, or give it back.

        Raises:
            ParameterError: Another browser drives it.
        """
        who = entities[0] if entities and sticks is not None else 0
        if who and any(each.driven == who for each in self.readers if each is not reader):
            raise ParameterError(f"another browser drives entity {who}")
        if reader.driven not in (0, who):
            self._live.drive(reader.driven, None)
        is_new = reader.driven != who or reader.sticks[0] != sticks
        reader.driven, reader.sticks = who, (sticks or [], time.monotonic())
        if who and is_new:
            self._live.drive(who, sticks)

    def _end_leases(self) -> None:
        """Give entities back whose drivers are silent: a connection can be lost without an end."""
        for reader in self.readers:
            if reader.driven and time.monotonic() - reader.sticks[1] > DRIVE_LEASE:
                self._refuse(
                    reader,
                    f"entity {reader.driven} is given back: nothing came from this page for {DRIVE_LEASE:g} s",
                )
                reader.is_drive_refused = True
                with given_by(str(reader.role)):
                    self._drive(reader, [], None)

    def _refuse(self, reader: Reader, reason: str) -> None:
        """Report a rejected value; of consecutive ones, only the first."""
        now = time.monotonic()
        if now - reader.refused_at >= REFUSAL_PERIOD:
            reader.refused_at, reader.refusal = now, reason

    def _look_back(self, reader: Reader, seconds: float) -> None:
        """Send frames of the last seconds, as many as the trails need."""
        live, now = self._live, self._seen.now.frame
        n = max(2, min(PAST_FRAMES, PAST_STATES // max(len(now), 1)))
        frames = {
            f.step: f for f in map(live.frame_at, np.linspace(max(now.t - seconds, live.span[0]), now.t, n))
        }
        past = [frames[step] for step in sorted(frames)]
        header = {"kind": "past", "epoch": live.epoch, "seconds": seconds}
        reader.past.append(message(header, pack(past[0].step, past, self._step)))
