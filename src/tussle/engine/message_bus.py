"""All topics of a simulation: outboxes, queued messages and inboxes."""

from __future__ import annotations

from typing import Any

import numpy as np

from tussle.declare.comms import TopicBuffer
from tussle.declare.lists import RaggedColumn
from tussle.declare.messages import Message, Messages
from tussle.errors import ParameterError, WiringError, listed, nearest_name
from tussle.plugins.stock import ALWAYS_THERE


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
        """The topic of a network by its name; created on first use.

        Raises:
            WiringError: The network does not exist, or the topic has another message type.
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

    def type_of(self, network: str, topic: str, name: str) -> type[Message]:
        """The type of a message by its name: that of the topic, or else the message type that is called so.

        Raises:
            ParameterError: No type has this name.
        """
        known = self.topics.get((network or ALWAYS_THERE[0], topic))
        if known is not None and known.type.__name__ == name:
            return known.type
        kinds = {kind.__name__: kind for kind in Message.__subclasses__()}
        if name not in kinds:
            raise ParameterError(
                f"there is no message {name!r}{nearest_name(name, kinds)}; {listed(sorted(kinds))}"
            )
        return kinds[name]

    def publish_to(self, type_: type[Message], network: str) -> TopicBuffer:
        """The topic named after the message type, for messages published by world plugins."""
        return self.topic(network, type_.__name__, type_, "world")

    def network_mismatches(self) -> list[str]:
        """A warning for each topic name that is published on one network only and subscribed to on another only."""
        topics = self.topics.values()
        return [
            f"topic {sent.name!r} is published on network {sent.network!r} and subscribed to on network {received.network!r}; "
            "its messages are not received; use the same network for Publish and Subscribe"
            for received in topics
            for sent in topics
            if sent.name == received.name
            and received.inboxes
            and not sent.inboxes
            and sent.is_published
            and not received.is_published
        ]

    def drop_worlds(self, gone: np.ndarray) -> None:
        for topic in self.topics.values():
            topic.drop_worlds(gone)

    def save(self) -> Any:
        """Copy outboxes, queues and inboxes. Batches and parcels are immutable, so copies of the lists suffice."""
        return {
            key: (t.type, list(t.queue), [list(i.deliveries) for i in t.inboxes], list(t.sent))
            for key, t in self.topics.items()
        }

    def restore(self, saved: Any) -> None:
        for (network, name), (type_, *_) in saved.items():
            self.topic(network, name, type_, "snapshot")
        for key, topic in self.topics.items():
            # Topics and inboxes created after the snapshot become empty.
            _, queue, deliveries, sent = saved.get(key, (None, [], [], []))
            topic.queue = list(queue)
            topic.clear_outbox()
            topic.sent.extend(sent)
            for i, inbox in enumerate(topic.inboxes):
                inbox.deliveries = list(deliveries[i]) if i < len(deliveries) else []

    def columns(self, world: int) -> list[bytes]:
        """Undelivered and unread messages of one world, for the state hash."""
        found: list[bytes] = []
        for key in sorted(self.topics):
            topic = self.topics[key]
            name = "/".join(key).encode()
            # Between steps, an outbox holds messages of `Simulation.publish` and of `start` of world plugins.
            sent = topic.outbox() if topic.sent else None
            if sent is not None and (mine := np.flatnonzero(sent.world == world)).size:
                found.append(b"|".join([name, b"said", *_numbers(sent.take(mine))]))
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
            # Inbox messages are keyed by the receivers' ids and sorted: the hash of a world must not depend on the number or order of
            # the groups of the stack.
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
