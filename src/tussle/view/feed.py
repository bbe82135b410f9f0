"""The messages of a live game by topic: how many a second, and the last one."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

import numpy as np

from tussle.declare.comms.topic import TopicBuffer
from tussle.engine.simulation import Simulation
from tussle.view.entity import ShownMessage, shown_messages

SPAN = 1.0
"""Time over which messages are counted [s]."""


@dataclass(frozen=True)
class TopicTraffic:
    """What was published on a topic.

    Attributes:
        topic: Network and name, "GlobalNetwork/Waypoint".
        rate: Messages in the last second of the game.
        last: The last one.
    """

    topic: str
    rate: int
    last: ShownMessage


@dataclass
class _Heard:
    counts: deque[tuple[int, int]] = field(default_factory=deque)
    last: ShownMessage | None = None


class MessageFeed:
    """Listens to what plugins publish in one world while it is open.

    Args:
        simulation: The simulation; used by the thread that steps it only.
        world: Number of the world.
    """

    def __init__(self, simulation: Simulation, world: int) -> None:
        self._simulation, self._world = simulation, world
        self._heard: dict[str, _Heard] = {}
        self.is_open = False

    def open(self) -> None:
        """Begin to listen."""
        if not self.is_open:
            self.is_open = True
            self._simulation.events.taps.append(self._take)

    def close(self) -> None:
        """Stop, and forget what was heard."""
        if self.is_open:
            self.is_open = False
            self._simulation.events.taps.remove(self._take)
            self._heard.clear()

    def _take(self, topic: TopicBuffer) -> None:
        batch = topic.outbox()
        mine = np.flatnonzero(batch.world == self._world)
        if len(mine):
            heard = self._heard.setdefault(f"{topic.network}/{topic.name}", _Heard())
            step = self._step()
            while heard.counts and heard.counts[-1][0] >= step:  # the game was rewound
                heard.counts.pop()
            heard.counts.append((step, len(mine)))
            (heard.last,) = shown_messages(topic, batch, mine[-1:])

    def _step(self) -> int:
        return int(self._simulation.state.context.clock.step[self._world])

    def read(self) -> list[TopicTraffic]:
        """The topics on which something was published, in the order of their names."""
        now, span = self._step(), max(1, round(SPAN / self._simulation.mission.dt))
        found = []
        for name, heard in sorted(self._heard.items()):
            while heard.counts and heard.counts[0][0] < now - span:
                heard.counts.popleft()
            if heard.last is not None:
                rate = sum(n for step, n in heard.counts if step < now)
                found.append(TopicTraffic(name, rate, heard.last))
        return found
