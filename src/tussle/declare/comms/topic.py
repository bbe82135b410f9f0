"""A topic: the outbox of a step, the queue of messages that are not yet delivered, and the inboxes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from tussle.declare.messages import Message, Messages
from tussle.numeric.arrays import numbers_below, order_by_row

EVERYONE: Final = "everyone"
SAME_ENTITY: Final = "same entity"


@dataclass(slots=True)
class Delivery:
    """Messages with their receivers and delivery times.

    Attributes:
        batch: The messages.
        due: Step at whose end each message is delivered, (n,).
        to: EVERYONE, SAME_ENTITY, or (message numbers, receivers' ids), each (m,).
    """

    batch: Messages
    due: np.ndarray
    to: Any

    def select(self, keep: np.ndarray) -> Delivery:
        """The messages where keep, (n,), is true, with their receivers."""
        index = np.flatnonzero(keep)
        to = self.to
        if not isinstance(to, str):
            number = np.cumsum(keep) - 1
            kept = keep[to[0]]
            to = (number[to[0][kept]], to[1][kept])
        return Delivery(self.batch.take(index), self.due[index], to)


class TopicBuffer:
    """One topic of one simulation.

    Attributes:
        network: Instance name of the network that carries it.
        name: The topic's name.
        type: The message type.
        inboxes: The receiving ends.
        is_published: Whether a plugin of the mission publishes it, or messages may come from outside.
    """

    def __init__(self, network: str, name: str, type_: type[Message]) -> None:
        self.network = network
        self.name = name
        self.type = type_
        self.sent: list[Messages] = []
        self.queue: list[Delivery] = []
        self.inboxes: list[Inbox] = []
        self.is_published = False
        self._joined: Messages | None = None

    def add(self, batch: Messages) -> None:
        """Put messages into this step's outbox."""
        if batch.n:
            self.sent.append(batch)
            self._joined = None

    def outbox(self) -> Messages:
        """All messages published in this step, ordered by (world, sender)."""
        if self._joined is None or self._joined.n == 0:
            self._joined = Messages.concatenate(self.sent) if self.sent else Messages.empty(self.type)
        return self._joined

    def is_receiver(self, n: int) -> np.ndarray:
        """Return True if each of the n rows of the body table subscribes to the topic, (n,)."""
        found = np.zeros(n, bool)
        for inbox in self.inboxes:
            found[inbox.view.first : inbox.view.last] = True
        return found

    def retain(self, first: int, keep: Callable[[Messages], np.ndarray]) -> None:
        """Remove messages from the outbox, from batch number `first` on, where keep(batch), (n,), is false."""
        kept = [batch.take(np.flatnonzero(keep(batch))) for batch in self.sent[first:]]
        self.sent[first:] = [batch for batch in kept if batch.n]
        self._joined = None

    def clear_outbox(self) -> None:
        self.sent.clear()
        self._joined = None

    def post(self, batch: Messages, to: Any, due: np.ndarray) -> None:
        """Queue messages for delivery."""
        self.queue.append(Delivery(batch, due, to))

    def deliver(self, step: np.ndarray) -> list[Delivery]:
        """Deliver all messages that are due at the end of the worlds' steps, (n_worlds,), and return them."""
        waiting: list[Delivery] = []
        delivered: list[Delivery] = []
        for delivery in self.queue:
            is_due = delivery.due <= step[delivery.batch.world]
            due = delivery if is_due.all() else delivery.select(is_due)
            if due.batch.n:
                delivered.append(due)
                for inbox in self.inboxes:
                    inbox.deliveries.append(due)
            if not is_due.all():
                waiting.append(delivery.select(~is_due))
        self.queue = waiting
        return delivered

    def drop_worlds(self, gone: np.ndarray) -> None:
        """Discard all messages of the worlds where gone, (n_worlds,), is true."""
        self.sent = [batch.take(np.flatnonzero(~gone[batch.world])) for batch in self.sent]
        self.sent = [batch for batch in self.sent if batch.n]
        self._joined = None
        self.queue = _without(self.queue, gone)
        for inbox in self.inboxes:
            inbox.deliveries = _without(inbox.deliveries, gone)


def _without(deliveries: list[Delivery], gone: np.ndarray) -> list[Delivery]:
    kept = []
    for delivery in deliveries:
        stays = ~gone[delivery.batch.world]
        if stays.all():
            kept.append(delivery)
        elif stays.any():
            kept.append(delivery.select(stays))
    return kept


class Inbox:
    """The receiving end of a topic at one plugin: the messages that arrived since the plugin's last call."""

    def __init__(self, topic: TopicBuffer, view: Any = None) -> None:
        self.topic = topic
        self.view = view
        self.deliveries: list[Delivery] = []
        if view is None or not getattr(view, "is_subset", False):
            topic.inboxes.append(self)

    def __bool__(self) -> bool:
        return bool(self.deliveries)

    @property
    def messages(self) -> Messages:
        """All messages that arrived, for any receiver."""
        return (
            Messages.concatenate([p.batch for p in self.deliveries])
            if self.deliveries
            else Messages.empty(self.topic.type)
        )

    def pairs(self) -> tuple[np.ndarray, Messages]:
        """(row, messages): one item per receiving row of the group and message, ordered by row, arrival and sender.

        Messages to everyone make rows x messages items; `latest` and `by_row` avoid this.
        """
        if not self.deliveries:
            return np.zeros(0, np.int64), Messages.empty(self.topic.type)
        rows, numbers, n = [], [], 0
        for delivery in self.deliveries:
            row, number = (
                self._receivers(delivery) if delivery.to != EVERYONE else self._broadcast_pairs(delivery)
            )
            rows.append(row)
            numbers.append(number + n)
            n += delivery.batch.n
        row, number = np.concatenate(rows), np.concatenate(numbers)
        if len(rows) > 1:
            order = order_by_row(row, self.view.n)
            row, number = row[order], number[order]
        return row, Messages.join([delivery.batch for delivery in self.deliveries]).take(number)

    def count_by_world(self, delivery: Delivery, n_worlds: int) -> np.ndarray:
        """Number of copies of messages that receivers get from a delivery, in each world, (n_worlds,)."""
        if delivery.to == EVERYONE:
            first, last = self._broadcast_range(delivery)
            copies, world = last - first, self.view.world
        else:
            row, _ = self._receivers(delivery)
            copies, world = np.ones(len(row), np.int64), self.view.world[row]
        found = np.zeros(n_worlds, np.int64)
        np.add.at(found, world, copies)
        return found

    def latest(self) -> tuple[np.ndarray, Messages]:
        """(row, messages): the last message of each row that received one."""
        view = self.view
        found_in, number = np.full(view.n, -1), np.zeros(view.n, np.int64)
        for k in range(len(self.deliveries) - 1, -1, -1):
            delivery = self.deliveries[k]
            if delivery.to == EVERYONE:
                first, last = self._broadcast_range(delivery)
                rows, numbers = np.flatnonzero(last > first), last[last > first] - 1
            else:
                rows, numbers = self._receivers(delivery)
            is_new = found_in[rows] < 0
            found_in[rows[is_new]] = k
            number[rows[is_new]] = numbers[is_new]  # of several for one row, the last one stays
        rows = np.flatnonzero(found_in >= 0)
        parts = [(rows[found_in[rows] == k], p.batch) for k, p in enumerate(self.deliveries)]
        parts = [(mine, batch) for mine, batch in parts if len(mine)]
        if not parts:
            return rows, Messages.empty(self.topic.type)
        together = Messages.join([batch.take(number[mine]) for mine, batch in parts])
        return rows, together.take(np.argsort(np.concatenate([mine for mine, _ in parts])))

    def by_row(self) -> Callable[[int], list[tuple[Messages, int]]]:
        """A function that returns the messages of a row, ordered by arrival and sender, each as (batch, message number)."""
        parts: list[tuple[Messages, np.ndarray, np.ndarray, np.ndarray | None]] = []
        for delivery in self.deliveries:
            if delivery.to == EVERYONE:
                parts.append((delivery.batch, *self._broadcast_range(delivery), None))
            else:
                row, number = self._receivers(delivery)
                edges = np.searchsorted(row, np.arange(self.view.n + 1))
                parts.append((delivery.batch, edges[:-1], edges[1:], number))

        def of(row: int) -> list[tuple[Messages, int]]:
            return [
                (batch, i if number is None else int(number[i]))
                for batch, first, last, number in parts
                for i in range(first[row], last[row])
            ]

        return of

    def _broadcast_range(self, delivery: Delivery) -> tuple[np.ndarray, np.ndarray]:
        """Range of the messages to everyone that each row receives, (n,): those of its world, if it was born by then."""
        view, sent = self.view, delivery.batch.world
        first, last = np.searchsorted(sent, view.world), np.searchsorted(sent, view.world, side="right")
        # The messages of one world in one parcel were delivered together.
        was_born = (last > first) & (view.born <= delivery.due[np.minimum(first, len(sent) - 1)])
        return first, np.where(was_born, last, first)

    def _broadcast_pairs(self, delivery: Delivery) -> tuple[np.ndarray, np.ndarray]:
        """(row, message number) for each row and message to everyone that it receives, by row."""
        first, last = self._broadcast_range(delivery)
        n = last - first
        row = np.repeat(np.arange(len(n)), n)
        return row, np.arange(len(row)) - np.repeat(np.cumsum(n) - n - first, n)

    def _receivers(self, delivery: Delivery) -> tuple[np.ndarray, np.ndarray]:
        """(row, message number) of messages that are not to everyone, by row."""
        view, batch = self.view, delivery.batch
        number, ids = (np.arange(batch.n), batch.sender) if isinstance(delivery.to, str) else delivery.to
        row = view.bodies_rows(batch.world[number], ids) - view.first
        is_here = (row >= 0) & (row < view.n)
        if not is_here.all():
            row, number = row[is_here], number[is_here]
        order = order_by_row(row, view.n)
        return row[order], number[order]

    def clear(self, heard: np.ndarray | None = None) -> None:
        """Discard the messages that were read: those of the worlds where `heard`, (n_worlds,), is true, by default of all."""
        self.deliveries = [] if heard is None or heard.all() else _without(self.deliveries, heard)


class Publisher:
    """The sending end of a topic at one plugin."""

    def __init__(self, topic: TopicBuffer, view: Any) -> None:
        self.topic = topic
        topic.is_published = True
        self.view = view

    def publish(self, rows: Any, **fields: Any) -> None:
        """Send one message from each of `rows`, (n,), or of a mask of all rows; fields are scalars, (n,) or (k, n).

        Raises:
            ParameterError: There is no such row or field, or a field has another shape.
        """
        view = self.view
        rows = numbers_below(view.n, rows, "publish: rows")
        if len(rows):
            view._differs("publishes before `finish`")
            self.topic.add(Messages.make(self.topic.type, view.world[rows], view.id[rows], fields))
