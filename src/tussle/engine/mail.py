"""Topics and networks: from this step's outboxes to the receivers' next call."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from tussle.comms import EVERYONE, SAME_ENTITY, TopicBuffer
from tussle.engine.referees import Referee
from tussle.errors import WiringError, listed, nearest_name
from tussle.messages import Message

if TYPE_CHECKING:
    from tussle.engine.simulation import Simulation


class Mail:
    """All topics of a simulation.

    Attributes:
        topics: (network, name) -> topic.
        networks: Instance name -> network.
    """

    def __init__(self, sim: Simulation) -> None:
        self.sim = sim
        self.topics: dict[tuple[str, str], TopicBuffer] = {}
        self.networks: dict[str, Referee] = {}
        self.names: list[str] = []

    def topic(self, network: str, name: str, type_: type[Message], where: str) -> TopicBuffer:
        """The topic of a network by its name; made when it is asked for first.

        Raises:
            WiringError: There is no such network, or the topic carries another type.
        """
        if network not in self.names:
            raise WiringError(f"{where}: topic {name!r} is on network {network!r}{nearest_name(network, self.names)}; {listed(self.names)}")
        key = (network, name)
        if key not in self.topics:
            buffer = self.topics[key] = TopicBuffer(network, name, type_)
            self.sim.world_view.by_type.setdefault(type_, []).append(buffer)
        if self.topics[key].type is not type_:
            raise WiringError(f"{where}: topic {name!r} on {network} carries {self.topics[key].type.__name__}, not {type_.__name__}")
        return self.topics[key]

    def publish_to(self, type_: type[Message], network: str) -> TopicBuffer:
        """Topic under the type's own name, for what the world says."""
        return self.topic(network, type_.__name__, type_, "world")

    def deliver(self) -> None:
        """Route what was published in this step, and hand over what is due."""
        step = self.sim.context.clock.step
        for topic in self.topics.values():
            if topic.sent:
                if topic.inboxes:
                    self._route(topic)
                topic.clear_outbox()
            if topic.queue:
                topic.deliver(step)

    def _route(self, topic: TopicBuffer) -> None:
        sim, network = self.sim, self.networks[topic.network]
        batch, clock = topic.outbox(), sim.context.clock
        view = network.view
        view.caller = network.plugin
        to = network.plugin.route(view, batch)
        if not isinstance(to, str):
            number, rows = to
            to = (np.asarray(number, np.int64), sim.population.bodies.id[np.asarray(rows, np.int64)])
        elif to not in (EVERYONE, SAME_ENTITY):
            raise WiringError(f"{topic.network}.route returned {to!r}; it is EVERYONE, SAME_ENTITY or (message numbers, rows)")
        delay = network.plugin.comm_delay[batch.world]
        steps = np.array([max(0, math.ceil(d / clock.dt - 1e-9)) for d in delay], np.int64)
        topic.post(to, clock.step[batch.world] + steps)

    def drop_worlds(self, gone: np.ndarray) -> None:
        for topic in self.topics.values():
            topic.drop_worlds(gone)

    def save(self) -> Any:
        """Queues and inboxes; parcels are never written to, so the lists are enough."""
        return [(list(t.queue), [list(i.parcels) for i in t.inboxes]) for t in self.topics.values()]

    def restore(self, saved: Any) -> None:
        for topic, (queue, parcels) in zip(self.topics.values(), saved, strict=True):
            topic.queue = list(queue)
            topic.clear_outbox()
            for inbox, mine in zip(topic.inboxes, parcels, strict=True):
                inbox.parcels = list(mine)

    def columns(self, world: int) -> list[bytes]:
        """What is on its way in one world, for the state hash."""
        found: list[bytes] = []
        for key in sorted(self.topics):
            topic = self.topics[key]
            parcels = [*topic.queue, *(p for i in topic.inboxes for p in i.parcels)]
            for parcel in parcels:
                mine = parcel.batch.world == world
                if mine.any():
                    part = parcel.select(mine)
                    to = part.to.encode() if isinstance(part.to, str) else b"".join(np.ascontiguousarray(a).tobytes() for a in part.to)
                    numbers = [v for v in part.batch.data.values() if isinstance(v, np.ndarray)]
                    found += ["/".join(key).encode(), to, part.due.tobytes(), part.batch.sender.tobytes(), *[np.ascontiguousarray(v).tobytes() for v in numbers]]
        return found
