"""What the community of a vehicle is told, and what its helm answers."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tussle import documents
from tussle.declare import texts
from tussle.errors import ParameterError
from tussle.pacing import Pace
from tussle.plugins.stock.autonomy.moos import wire
from tussle.plugins.stock.autonomy.moos.client import MoosClient

DESIRED = ("DESIRED_HEADING", "DESIRED_SPEED", "DESIRED_DEPTH")
STATE, STEP, DONE = "IVPHELM_STATE", "TUSSLE_STEP", "TUSSLE_STEP_DONE"
DEPLOYMENT = {"DEPLOY": "true", "RETURN": "false", "MOOS_MANUAL_OVERRIDE": "false"}
"""Variables that are sent to a helm after its first message."""
MALCONFIG = "MALCONFIG"
"""State of a helm that does not understand its configuration; it never steers."""
PER_STEP = 32
"""Messages that a helm may send for each step that it answers."""


class Vessel:
    """The handle of an entity: its community.

    Args:
        community: Where the community is.
        name: Name of the client.
        timeout: Longest wait for MOOSDB and helm [s].
        lockstep: Whether the helm answers each step.
        on_loss: What happens when the MOOSDB ends: "end", or, until it comes back, "wait" or "go_on" with the last commands.
        release: Called after the connection has been closed.

    Attributes:
        client: The connection.
        reported: When the contacts were reported last [s of the world].
    """

    def __init__(
        self,
        community: MoosCommunity,
        name: str,
        timeout: float,
        lockstep: bool,
        on_loss: str,
        release: Callable[[], object],
    ) -> None:
        self.timeout, self.lockstep, self.time_warp = timeout, lockstep, community.time_warp
        self.reported, self._release = -math.inf, release
        self._pace, self._goes_on = Pace(self.time_warp), on_loss == "go_on"
        self._sent: list[bytes] = []
        self._has_begun, self._n_lost = False, 0
        self._state = ""
        self._last_message = time.monotonic()
        self._step = -1.0
        self._wanted: dict[str, float] = {}
        self._answer: dict[str, float] | None = None
        self._source, self._former = "", set[str]()
        variables = (*DESIRED, STATE, DONE)
        self.client = MoosClient(
            community.host, community.port, name, community.name, variables, timeout, self._receive,
            None if on_loss == "end" else self._lose,
        )  # fmt: skip
        self.client.start()  # whose thread calls `_receive`

    @property
    def failure(self) -> str:
        """Why it cannot go on, or empty."""
        return self.client.failure

    def close(self) -> None:
        """End the connection."""
        self.client.close()
        self._release()

    def await_helm(self, limit: float) -> None:
        """Wait for the MOOSDB and a helm, until a time of `time.monotonic`; while it goes on without them, only in the first step."""
        if not (self._goes_on and self._has_begun):
            self._await(lambda: bool(self._state), limit, "no helm has been heard")
            self._has_begun = True

    def await_clock(self, t: float, dt: float) -> None:
        """Wait until simulated time t is due, where the last call was for t - dt."""
        left = self._pace.due_in(t, dt)
        with self.client.changed:
            self.client.changed.wait_for(lambda: bool(self.failure), max(left, 0.0))
        if self._state and time.monotonic() - self._last_message > self.timeout:
            self.client.fail(f"the helm has been silent for {self.timeout:g} s{self._state_text()}")

    def await_answer(self, limit: float) -> None:
        """Wait until the helm has answered the last step, until a time of `time.monotonic`."""
        text = f"the helm has not answered the step {self._step:g} ({STEP}) with {DONE}"
        self._await(self._has_answer_or_loss, limit, text)
        while self._answer is None and not self.failure:
            if self._goes_on:
                self._answer = dict(self._wanted)
                return
            limit = time.monotonic() + self.timeout
            self._await(lambda: bool(self._state), limit, "no helm has been heard")
            self._n_lost = self.client.n_lost
            self.client.send(self._sent)
            self._await(self._has_answer_or_loss, limit, text)

    def _has_answer_or_loss(self) -> bool:
        return self._answer is not None or self.client.n_lost > self._n_lost

    def publish(self, numbers: list[bytes], reports: list[bytes], step: int, now: float) -> None:
        """Send numbers and texts, each as `wire.encode_tail` returns it; in lockstep also the step, which the helm is to answer."""
        messages = [*map(self.client.number, numbers), *map(self.client.text, reports)]
        if self.lockstep:
            with self.client.changed:
                self._step, self._answer = float(step), None
                self._n_lost = self.client.n_lost - bool(self.client.trouble)
            messages.append(self.client.number(wire.encode_tail(STEP, float(step), now)))
        self._sent = messages
        self.client.send(messages)

    @property
    def moos_time(self) -> float:
        """Time of MOOS [s]: that of the clock since 1970 times the time warp."""
        return time.time() * self.time_warp

    def commands(self) -> dict[str, float]:
        """Return the last desired values: heading [deg], clockwise from North; speed [m/s]; depth [m]."""
        with self.client.changed:
            return dict(self._wanted if not self.lockstep else self._answer or {})

    def _await(self, is_done: Callable[[], bool], limit: float, text: str) -> None:
        with self.client.changed:
            left = max(limit - time.monotonic(), 0.0)
            if not self.client.changed.wait_for(lambda: is_done() or bool(self.failure), left):
                trouble = self.client.trouble
                what = f"no connection within {self.timeout:g} s ({trouble})" if trouble else ""
                self.client.fail(what or f"{text} within {self.timeout:g} s{self._state_text()}")

    def _state_text(self) -> str:
        return f"; its state is {texts.shown(self._state)}" if self._state else ""

    # -- in the client's thread ------------------------------------------------------------------------------------------------------

    def _lose(self) -> None:
        """The MOOSDB has gone, and with it what the helm was told; a helm that comes back begins anew."""
        self._state, self._source = "", ""
        self._former.clear()

    def _receive(self, message: wire.MoosMessage) -> None:
        """Take a message of the helm.

        Raises:
            ConnectionError: It makes no sense.
        """
        key, value = message.key, message.value
        if key == STATE:
            if not self._state:
                orders = [wire.encode_tail(k, v, self.moos_time) for k, v in DEPLOYMENT.items()]
                self.client.send([*map(self.client.text, orders)])
            self._state = str(value) or "unknown"
        elif key in DESIRED or key == DONE:
            if isinstance(value, str) or not math.isfinite(value):
                raise ConnectionError(f"{message.source} says {key} = {value!r}; it takes a finite number")
            if key in DESIRED:
                self._accept_helm(message.source, key)
                self._wanted[key] = value
            elif value == self._step and self._answer is None:
                self._answer = dict(self._wanted)
                self.client.allow(PER_STEP)
        if self._state != MALCONFIG:
            self._last_message = time.monotonic()

    def _accept_helm(self, source: str, key: str) -> None:
        """Accept a command of a helm: a new helm may take over, but two may not alternate.

        Raises:
            ConnectionError: A former helm sets a variable again.
        """
        if source != self._source:
            if source in self._former:
                raise ConnectionError(f"{source} and {self._source} both set {key}")
            self._former.add(self._source)
            self._source = source


HOST, PORT = "127.0.0.1", 9000
"""Host and port of a MOOSDB where neither parameters nor a mission file name them."""


@dataclass(frozen=True)
class MoosCommunity:
    """A community.

    Attributes:
        host: Where its MOOSDB is.
        port: Port of the MOOSDB.
        name: Name; empty for any.
        time_warp: Seconds of MOOS's time per second.
    """

    host: str
    port: int
    name: str
    time_warp: float


def community_of(values: dict[str, Any]) -> MoosCommunity:
    """The community that the parameters of a MOOSAutonomy and their mission file name.

    Raises:
        ParameterError: The file cannot be read, or a value in it is not allowed.
    """
    path = values["moos_mission_file"]
    settings = _read_settings(Path(path).expanduser()) if path else {}

    def number(key: str, least: float, most: float, usual: float) -> float:
        text = settings.get(key.lower(), str(usual))
        try:
            found = float(text)
        except ValueError:
            found = least - 1.0
        if not least <= found <= most:
            raise ParameterError(
                f"{path}: {key} = {text!r} is not allowed; it takes a number from {least:g} to {most:g}"
            )
        return found

    host = values["moos_host"] or settings.get("serverhost", HOST)
    return MoosCommunity(
        HOST if host.lower() == "localhost" else host,
        values["moos_port"] or int(number("ServerPort", 1, 65535, PORT)),
        values["moos_community"] or settings.get("community", ""),
        values["moos_time_warp"] or number("MOOSTimeWarp", 0.001, 1000.0, 1.0),
    )


def _read_settings(path: Path) -> dict[str, str]:
    """Values of a mission file outside of its blocks, by names in lower case; // begins a comment, and the first line counts."""
    settings: dict[str, str] = {}
    depth = 0
    for line in documents.read_text(path, ParameterError).splitlines():
        text = line.partition("//")[0].strip()
        key, is_value, value = text.partition("=")
        name = key.strip().lower()
        if is_value and not depth and name != "processconfig":
            settings.setdefault(name, value.strip().strip('"'))
        depth += text.count("{") - text.count("}")
    return settings
