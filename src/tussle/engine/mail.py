"""Topics and networks: from this step's outboxes to the receivers' next call."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from tussle.comms import EVERYONE, SAME_ENTITY, TopicBuffer
from tussle.engine import failure
from tussle.engine.referees import Referee
from tussle.errors import MissionError, PluginError, WiringError, listed, nearest_name
from tussle.lists import RaggedColumn
from tussle.messages import Batch, Message, SpawnEntity
from tussle.stock import ALWAYS_THERE

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
        network = network or ALWAYS_THERE[0]
        if network not in self.names:
            raise WiringError(
                f"{where}: topic {name!r} is on network {network!r}{nearest_name(network, self.names)}; {listed(self.names)}"
            )
        key = (network, name)
        if key not in self.topics:
            buffer = self.topics[key] = TopicBuffer(network, name, type_)
            self.sim.world_view.by_type.setdefault(type_, []).append(buffer)
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

    def deliver(self) -> None:
        """Route what was published in this step, and hand over what is due."""
        step = self.sim.context.clock.step
        for topic in self.topics.values():
            if topic.sent:
                if topic.type is SpawnEntity:
                    self._ask_for_births(topic.outbox())
                if topic.inboxes:
                    self._post(topic)
                topic.clear_outbox()
            if topic.queue:
                topic.deliver(step)

    def _ask_for_births(self, batch: Batch) -> None:
        """Turn `SpawnEntity` messages into births at the beginning of the next step, block by block in the mission's order."""
        view = self.sim.world_view
        has_attitude = (batch.quat != 0.0).any(axis=0)
        known = {name: k for k, name in enumerate(view.templates)}
        number = np.array([known.get(str(block), -1) for block in batch.block], np.int64)
        for k, turned in sorted(set(zip(number.tolist(), has_attitude.tolist(), strict=True))):
            index = np.flatnonzero((number == k) & (has_attitude == turned))
            attitude = {"quat": batch.quat[:, index]} if turned else {}
            if k >= 0:
                where = {"pos": batch.pos[:, index], "vel": batch.vel[:, index], **attitude}
                view.spawn(view.templates[k], batch.world[index], **where)
        for i in np.flatnonzero(number < 0):
            block, world = batch.block[i], int(batch.world[i])
            if not self.sim.failed[world]:
                error = MissionError(
                    f"SpawnEntity: there is no block {block!r}{nearest_name(str(block), view.templates)}; {listed(view.templates)}"
                )
                self.sim.record_failure(
                    world,
                    PluginError(
                        str(error),
                        where=f"sent by entity {int(batch.sender[i])}",
                        step=int(self.sim.steps[world]),
                        world=world,
                    ),
                )

    def _post(self, topic: TopicBuffer) -> None:
        network, batch = self.networks[topic.network], topic.outbox()
        try:
            self._route(topic, network, batch)
        except Exception as error:
            raise failure.in_call(error, network.plugin, network.view) from error

    def _route(self, topic: TopicBuffer, network: Referee, batch: Batch) -> None:
        sim, clock, view = self.sim, self.sim.context.clock, network.view
        view.begin(network.plugin, 1.0, clock.dt)
        to = network.plugin.route(view, batch)
        if not isinstance(to, str):
            number, rows = to
            to = (np.asarray(number, np.int64), sim.population.bodies.id[np.asarray(rows, np.int64)])
        elif to not in (EVERYONE, SAME_ENTITY):
            raise WiringError(
                f"{topic.network}.route returned {to!r}; it is EVERYONE, SAME_ENTITY or (message numbers, rows)"
            )
        delay = network.plugin.comm_delay[batch.world]
        steps = np.array([max(0, math.ceil(d / clock.dt - 1e-9)) for d in delay], np.int64)
        topic.post(batch, to, clock.step[batch.world] + steps)

    def drop_worlds(self, gone: np.ndarray) -> None:
        for topic in self.topics.values():
            topic.drop_worlds(gone)

    def save(self) -> Any:
        """Outboxes, queues and inboxes; batches and parcels are never written to, so the lists are enough."""
        return {
            key: (t.type, list(t.queue), [list(i.parcels) for i in t.inboxes], list(t.sent))
            for key, t in self.topics.items()
        }

    def restore(self, saved: Any) -> None:
        for (network, name), (type_, *_) in saved.items():
            self.topic(network, name, type_, "snapshot")
        for key, topic in self.topics.items():
            _, queue, parcels, sent = saved.get(
                key, (None, [], [], [])
            )  # a topic or group that came later has had nothing then
            topic.queue = list(queue)
            topic.clear_outbox()
            topic.sent.extend(sent)
            for i, inbox in enumerate(topic.inboxes):
                inbox.parcels = list(parcels[i]) if i < len(parcels) else []

    def columns(self, world: int) -> list[bytes]:
        """What is on its way in one world, for the state hash."""
        found: list[bytes] = []
        for key in sorted(self.topics):
            topic = self.topics[key]
            name = "/".join(key).encode()
            said = topic.outbox() if topic.sent else None  # from outside, or by a referee at the start
            if said is not None and (mine := np.flatnonzero(said.world == world)).size:
                found.append(b"|".join([name, b"said", *_numbers(said.take(mine))]))
            for parcel in topic.queue:
                mine = parcel.batch.world == world
                if mine.any():
                    part = parcel.select(mine)
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


def _numbers(batch: Batch) -> list[bytes]:
    values: list[bytes] = [batch.sender.tobytes()]
    for value in batch.data.values():
        if isinstance(value, RaggedColumn):
            values += [value.start.tobytes(), np.ascontiguousarray(value.data).tobytes()]
        elif isinstance(value, np.ndarray):
            values.append(np.ascontiguousarray(value).tobytes())
    return values
