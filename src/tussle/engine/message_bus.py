"""All topics of a simulation: what was said, what is on its way, who has heard what."""

from __future__ import annotations

from typing import Any

import numpy as np

from tussle.comms import TopicBuffer
from tussle.errors import WiringError, listed, nearest_name
from tussle.lists import RaggedColumn
from tussle.messages import Message, Messages
from tussle.stock import ALWAYS_THERE


class MessageBus:
    """All topics of a simulation.

    Attributes:
        networks: Instance names of the networks.
        topics: (network, name) -> topic.
        by_type: Message type -> its topics.
    """

    def __init__(self, networks: list[str]) -> None:
        self.networks = networks
        self.topics: dict[tuple[str, str], TopicBuffer] = {}
        self.by_type: dict[type[Message], list[TopicBuffer]] = {}

    def topic(self, network: str, name: str, type_: type[Message], where: str) -> TopicBuffer:
        """The topic of a network by its name; made when it is asked for first.

        Raises:
            WiringError: There is no such network, or the topic carries another type.
        """
        network = network or ALWAYS_THERE[0]
        if network not in self.networks:
            raise WiringError(
                f"{where}: topic {name!r} is on network {network!r}{nearest_name(network, self.networks)}; {listed(self.networks)}"
            )
        key = (network, name)
        if key not in self.topics:
            buffer = self.topics[key] = TopicBuffer(network, name, type_)
            self.by_type.setdefault(type_, []).append(buffer)
        if self.topics[key].type is not type_:
            raise WiringError(
                f"{where}: topic {name!r} on {network} carries {self.topics[key].type.__name__}, not {type_.__name__}"
            )
        return self.topics[key]

    def publish_to(self, type_: type[Message], network: str) -> TopicBuffer:
        """Topic under the type's own name, for what the world says."""
        return self.topic(network, type_.__name__, type_, "world")

    def unheard(self) -> list[str]:
        """A sentence for each topic that some publish on one network and others listen to on another only."""
        topics = self.topics.values()
        return [
            f"{said.name!r} is published on network {said.network!r} and listened to on {heard.network!r}, so nobody hears it; "
            "the network of a Publish and of its Subscribe must be one"
            for heard in topics
            for said in topics
            if said.name == heard.name
            and heard.inboxes
            and not said.inboxes
            and said.is_published
            and not heard.is_published
        ]

    def drop_worlds(self, gone: np.ndarray) -> None:
        for topic in self.topics.values():
            topic.drop_worlds(gone)

    def save(self) -> Any:
        """Outboxes, queues and inboxes; batches and parcels are never written to, so the lists are enough."""
        return {
            key: (t.type, list(t.queue), [list(i.deliveries) for i in t.inboxes], list(t.sent))
            for key, t in self.topics.items()
        }

    def restore(self, saved: Any) -> None:
        for (network, name), (type_, *_) in saved.items():
            self.topic(network, name, type_, "snapshot")
        for key, topic in self.topics.items():
            _, queue, deliveries, sent = saved.get(
                key, (None, [], [], [])
            )  # a topic or group that came later has had nothing then
            topic.queue = list(queue)
            topic.clear_outbox()
            topic.sent.extend(sent)
            for i, inbox in enumerate(topic.inboxes):
                inbox.deliveries = list(deliveries[i]) if i < len(deliveries) else []

    def columns(self, world: int) -> list[bytes]:
        """What is on its way in one world, for the state hash."""
        found: list[bytes] = []
        for key in sorted(self.topics):
            topic = self.topics[key]
            name = "/".join(key).encode()
            said = topic.outbox() if topic.sent else None  # from outside, or by a referee at the start
            if said is not None and (mine := np.flatnonzero(said.world == world)).size:
                found.append(b"|".join([name, b"said", *_numbers(said.take(mine))]))
            for delivery in topic.queue:
                mine = delivery.batch.world == world
                if mine.any():
                    part = delivery.select(mine)
                    to = (
                        part.to.encode()
                        if isinstance(part.to, str)
                        else b"".join(np.ascontiguousarray(a).tobytes() for a in part.to)
                    )
                    found.append(b"|".join([name, to, part.due.tobytes(), *_numbers(part.batch)]))
            # What waits in inboxes counts by who will read it: how many groups a stack has is nothing to a world. Sorted, since
            # the order of groups is nothing to it either.
            waiting = []
            for inbox in topic.inboxes:
                rows, batch = inbox.pairs()
                mine = np.flatnonzero(batch.world == world)
                if len(mine):
                    waiting.append(
                        b"|".join([name, inbox.view.id[rows[mine]].tobytes(), *_numbers(batch.take(mine))])
                    )
            found += sorted(waiting)
        return found


def _numbers(batch: Messages) -> list[bytes]:
    values: list[bytes] = [batch.sender.tobytes()]
    for value in batch.data.values():
        if isinstance(value, RaggedColumn):
            values += [value.start.tobytes(), np.ascontiguousarray(value.data).tobytes()]
        elif isinstance(value, np.ndarray):
            values.append(np.ascontiguousarray(value).tobytes())
    return values
