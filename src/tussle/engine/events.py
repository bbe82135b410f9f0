"""Event notification: births, deaths, captures, collisions, flags and ends. Costs nothing without listeners."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from typing import TYPE_CHECKING

import numpy as np

from tussle.api.bodies import Bodies
from tussle.api.context import Context
from tussle.api.links import Links
from tussle.api.world import WorldView
from tussle.declare.comms.topic import Delivery, TopicBuffer
from tussle.declare.messages import (
    EntityCaptured,
    EntityCollided,
    EntityHitGround,
    FlagCaptured,
    FlagTaken,
    Message,
)
from tussle.record import Events
from tussle.record.events import BIRTH, CAPTURE, COLLISION, DEATH, END, FLAG, KINDS
from tussle.record.inputs import InputListener

if TYPE_CHECKING:
    from tussle.record.traffic import Traffic

REPORTED: dict[type[Message], tuple[str, str, str, str]] = {
    EntityCaptured: (CAPTURE, "source", "target", ""),
    EntityCollided: (COLLISION, "first", "second", ""),
    EntityHitGround: (COLLISION, "entity", "", "ground"),
    FlagTaken: (FLAG, "entity", "", "took the flag"),
    FlagCaptured: (FLAG, "entity", "", "brought the flag home"),
}
"""Message type -> event kind, message fields for the event's `id` and `other` ("" for none), and the event's text."""


class Listeners:
    """Functions called with each `Events` of a simulation. The object is true if there are listeners.

    Attributes:
        is_replaying: True while steps are repeated that have been reported already; listeners are not called.
        on_change: Called when a listener is added or removed.
        traffic: Objects that count messages.
        taps: Functions called with each topic on which messages were published in a step, also in steps that are repeated.
        inputs: Functions called with the world and each `ExternalInput` from outside.
    """

    def __init__(self, context: Context) -> None:
        self.is_replaying = False
        self.on_change: Callable[[], None] = lambda: None
        self.traffic: list[Traffic] = []
        self.taps: list[Callable[[TopicBuffer], None]] = []
        self.inputs: list[InputListener] = []
        self._context = context
        self._listeners: list[tuple[Callable[[Events], None], frozenset[str]]] = []
        self._causes: dict[tuple[int, int], int] = {}

    def __bool__(self) -> bool:
        return bool(self._listeners)

    def listen(self, listener: Callable[[Events], None], kinds: Collection[str] = KINDS) -> None:
        """Add a listener, which is called with all later events of some kinds; by default of all kinds."""
        self._listeners.append((listener, frozenset(kinds)))
        self.on_change()

    def forget(self, listener: Callable[[Events], None]) -> None:
        """Remove a listener. Does nothing if it was not added."""
        added = [known for known, _ in self._listeners]
        if listener in added:
            del self._listeners[added.index(listener)]
            self.on_change()

    def _report(self, events: Events) -> None:
        for listener, kinds in () if self.is_replaying else list(self._listeners):
            if events.kind in kinds:
                listener(events)

    def births(self, new: Bodies) -> None:
        """Report the births of new entities."""
        if not any(BIRTH in kinds for _, kinds in self._listeners):
            return  # their texts take longer than the rest
        names = self._context.block_names
        step = self._context.clock.step[new.world]
        text = [names[b] for b in new.block]
        self._report(Events(BIRTH, new.world, step, new.id, np.zeros_like(new.id), text))

    def messages(self, view: WorldView) -> None:
        """Report captures, collisions and flags of this step, from the messages in the outboxes."""
        if self._causes:
            self._causes.clear()
        for type_ in REPORTED:
            for topic in view.by_type.get(type_, ()):
                if topic.sent:
                    self._report_messages(view, type_)
                    break

    def _report_messages(self, view: WorldView, type_: type[Message]) -> None:
        kind, first, second, text = REPORTED[type_]
        batch = view.inbox(type_)
        first_ids = batch.data[first]
        second_ids = batch.data[second] if second else np.zeros_like(first_ids)
        step = self._context.clock.step[batch.world]
        self._report(Events(kind, batch.world, step, first_ids, second_ids, [text] * batch.n))
        if not second:
            return
        for world, a, b in zip(batch.world.tolist(), first_ids.tolist(), second_ids.tolist(), strict=True):
            self._causes.setdefault((world, b), a)
            if kind == COLLISION:
                self._causes.setdefault((world, a), b)

    def deaths(self, bodies: Bodies, deaths: list[tuple[np.ndarray, str]], step: np.ndarray) -> None:
        """Report deaths, before the rows are removed. If a row occurs twice, the first reason is reported.

        Args:
            bodies: The body table.
            deaths: (rows, reason) of each call of `kill`.
            step: Step of the deaths in each world, (n_worlds,).
        """
        rows = np.concatenate([rows for rows, _ in deaths])
        why = [text for some, text in deaths for _ in range(len(some))]
        key = bodies.world[rows] << 32 | bodies.id[rows]
        if not (key[1:] > key[:-1]).all():
            _, first = np.unique(key, return_index=True)
            rows, why = rows[first], [why[i] for i in first]
        world, ids, by = bodies.world[rows], bodies.id[rows], np.zeros(len(rows), np.int64)
        if self._causes:
            by[:] = [self._causes.get(who, 0) for who in zip(world.tolist(), ids.tolist(), strict=True)]
        self._report(Events(DEATH, world, step[world], ids, by, why))

    def end(self, world: int, reason: str) -> None:
        """Report the end of a world."""
        numbers, none = np.array([world]), np.zeros(1, np.int64)
        self._report(Events(END, numbers, self._context.clock.step[numbers], none, none, [reason]))

    def published(self, topic: TopicBuffer) -> None:
        """Report the messages of a topic that are published in this step."""
        for tap in self.taps:
            tap(topic)
        for counter in () if self.is_replaying else self.traffic:
            worlds = np.bincount(topic.outbox().world, minlength=len(self._context.seeds))
            counter.published(topic.network, topic.name, worlds)

    def received(self, topic: TopicBuffer, deliveries: Sequence[Delivery]) -> None:
        """Report the messages of a topic that are received at the end of this step."""
        for counter in () if self.is_replaying else self.traffic:
            for inbox in topic.inboxes if counter.counts_received(topic.network, topic.name) else ():
                for delivery in deliveries:
                    copies = inbox.count_by_world(delivery, len(self._context.seeds))
                    counter.received(topic.network, topic.name, copies)

    def links(self, network: str, ids: np.ndarray, links: Links, chosen: np.ndarray) -> None:
        """Report the links of a network in this step where `chosen`, (m,), is true; `ids` are those of all rows."""
        for counter in () if self.is_replaying else self.traffic:
            message, receiver = links.message[chosen], ids[links.receiver[chosen]]
            sender = ids[links.sender[message]]
            counter.links(network, links.world[message], sender, receiver, links.outcome[chosen])

    def delivered(self, running: np.ndarray) -> None:
        """Report that all messages of a step are delivered, in the worlds where `running`, (n_worlds,), is true."""
        for counter in () if self.is_replaying else self.traffic:
            counter.end_step(self._context.clock.t, running)
