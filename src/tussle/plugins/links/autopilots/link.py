"""The connection of a vehicle with its autopilot, and waiting for several of them."""

from __future__ import annotations

import math
import select
import socket
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Sequence

from tussle.errors import ParameterError, PortError
from tussle.pacing import Pace
from tussle.plugins.links.autopilots.frames import VehicleState
from tussle.plugins.links.ports import opening

TICK_PERIOD = 0.01
"""Longest wait before a state is sent again [s]."""
MAX_STEP_TIME = 1.0
"""Wall time of a step beyond which the simulation is paused, or waits for another autopilot [s]."""
MAX_PORT = 65535


class AutopilotLink(ABC):
    """A connection with an autopilot; abstract. Nothing in it waits.

    Args:
        autopilot: Name and place of the autopilot, for errors.
        lockstep: Whether the autopilot answers each state.
        timeout: Longest wait for it [s].
        release: Called after the connection has been closed.

    Attributes:
        commands: The newest commands by number of the output; None before the first ones.
        failure: Why it cannot go on; empty if all is well.
        is_done: Whether the step may go on: the autopilot has answered its state, or without lockstep has been heard.
        is_unanswered: Whether the step goes on with the commands before, without an answer, in lockstep.
        has_restarted: Whether the autopilot has started anew, in this step.
    """

    def __init__(self, autopilot: str, lockstep: bool, timeout: float, release: Callable[[], object]) -> None:
        self.autopilot, self.lockstep, self.timeout = autopilot, lockstep, timeout
        self._release = release
        self.commands: dict[int, float] | None = None
        self.failure = ""
        self.is_done = False
        self.is_unanswered = self.has_restarted = False
        self._silence, self._left = 0.0, time.monotonic()

    def fail(self, why: str) -> None:
        """Give up; the first reason is kept."""
        self.failure = self.failure or f"{self.autopilot}: {why}"

    def close(self) -> None:
        """Close the sockets."""
        for each in self.sockets():
            each.close()
        self._release()

    def hear(self) -> None:
        """The autopilot has said something."""
        self._silence = 0.0

    def leave(self) -> None:
        """End a step. Without lockstep, an autopilot that has been silent for too long has failed; a pause is not silence."""
        now = time.monotonic()
        self._silence += min(now - self._left, MAX_STEP_TIME)
        self._left = now
        if self._silence > self.timeout and not self.lockstep:
            self.fail(f"silent for {self.timeout:g} s")

    @abstractmethod
    def begin(self, state: VehicleState, draws: Sequence[float]) -> None:
        """Begin a step: tell the autopilot the state of its vehicle; draws: standard normal numbers."""

    @abstractmethod
    def receive(self) -> None:
        """Read what is there."""

    @abstractmethod
    def tick(self, now: float) -> None:
        """Repeat what has to be repeated; now: `time.monotonic` [s]."""

    @abstractmethod
    def missing(self) -> str:
        """What has not come."""

    @abstractmethod
    def sockets(self) -> list[socket.socket]:
        """The open sockets."""


class OwnedPorts(dict[int, str]):
    """Port -> its vehicle: no two of a simulation share one."""

    def end(self) -> None:
        """Forget them."""
        self.clear()

    def claim(self, owner: str, ports: Iterable[int], advice: str) -> Callable[[], None]:
        """Reserve ports; returns what releases them.

        Raises:
            ParameterError: A port is taken or is none.
        """
        ports = tuple(ports)
        for port in ports:
            if port in self or not 0 < port <= MAX_PORT:
                why = f"is that of {self[port]}" if port in self else f"is not from 1 to {MAX_PORT}"
                raise ParameterError(f"port {port} {why}; {advice}")
        self.update(dict.fromkeys(ports, owner))

        def release() -> None:
            for port in ports:
                self.pop(port, None)

        return release


def resolved(host: str, what: str) -> str:
    """The address (IPv4) of a host.

    Raises:
        ParameterError: There is none.
    """
    try:
        return socket.gethostbyname(host)
    except (OSError, UnicodeError) as error:
        raise ParameterError(f"{what} = {host!r} is no host: {getattr(error, 'strerror', error)}") from None


def bound(kind: socket.SocketKind, host: str, port: int, what: str) -> socket.socket:
    """A socket that is bound to an address, and does not wait.

    Raises:
        PortError: The address cannot be used.
    """
    made = socket.socket(socket.AF_INET, kind)
    made.setblocking(False)
    try:
        with opening(what, host, port):
            if kind == socket.SOCK_STREAM:  # a port whose last connection has just ended is free
                made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            made.bind((host, port))
    except PortError:
        made.close()
        raise
    return made


def await_links(links: Sequence[AutopilotLink], is_interrupted: Callable[[], bool]) -> None:
    """Wait until all autopilots have done their part; those that have not within their time fail."""
    waiting = list(links)
    limit = time.monotonic() + max((link.timeout for link in links), default=0.0)
    while True:
        now = time.monotonic()
        for link in waiting:
            link.receive()
            link.tick(now)
        waiting = [link for link in waiting if not (link.is_done or link.failure)]
        if not waiting or is_interrupted():
            return
        if now >= limit:
            for link in waiting:
                link.fail(f"{link.missing()} within {link.timeout:g} s")
            return
        poller = select.poll()
        for link in waiting:
            for each in link.sockets():
                poller.register(each, select.POLLIN)
        poller.poll(math.ceil(1000.0 * min(TICK_PERIOD, limit - now)))


class StepClock:
    """The clock of a simulation that runs beside its autopilots."""

    def __init__(self, warp: float) -> None:
        self.pace = Pace(warp)

    def end(self) -> None:
        """Nothing is open."""
