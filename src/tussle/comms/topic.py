"""A topic: the outbox of a step, the queue of messages that are not yet delivered, and the inboxes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from tussle.messages import Batch, Message

EVERYONE: Final = "everyone"
SAME_ENTITY: Final = "same entity"


@dataclass(slots=True)
class Parcel:
    """Messages with their receivers and delivery times.

    Attributes:
        batch: The messages.
        due: Step at whose end each message is delivered, (n,).
        to: EVERYONE, SAME_ENTITY, or (message numbers, receivers' ids), each (m,).
    """

    batch: Batch
    due: np.ndarray
    to: Any

    def select(self, keep: np.ndarray) -> Parcel:
        """The messages where keep, (n,), is true, with their receivers."""
        index = np.flatnonzero(keep)
        to = self.to
        if not isinstance(to, str):
            number = np.cumsum(keep) - 1
            kept = keep[to[0]]
            to = (number[to[0][kept]], to[1][kept])
        return Parcel(self.batch.take(index), self.due[index], to)


class TopicBuffer:
    """One topic of one simulation.

    Attributes:
        network: Instance name of the network that carries it.
        name: The topic's name.
        type: The message type.
        inboxes: The receiving ends.
        is_published: Whether a plugin of the mission publishes it.
    """

    def __init__(self, network: str, name: str, type_: type[Message]) -> None:
        self.network = network
        self.name = name
        self.type = type_
        self.sent: list[Batch] = []
        self.queue: list[Parcel] = []
        self.inboxes: list[Inbox] = []
        self.is_published = False
        self._joined: Batch | None = None

    def add(self, batch: Batch) -> None:
        """Put messages into this step's outbox."""
        if batch.n:
            self.sent.append(batch)
            self._joined = None

    def outbox(self) -> Batch:
        """All messages published in this step, ordered by (world, sender)."""
        if self._joined is None or self._joined.n == 0:
            self._joined = Batch.concatenate(self.sent) if self.sent else Batch.empty(self.type)
        return self._joined

    def clear_outbox(self) -> None:
        self.sent.clear()
        self._joined = None

    def post(self, batch: Batch, to: Any, due: np.ndarray) -> None:
        """Queue messages for delivery."""
        self.queue.append(Parcel(batch, due, to))

    def deliver(self, step: np.ndarray) -> None:
        """Deliver all messages that are due at the end of the worlds' steps, (n_worlds,)."""
        waiting: list[Parcel] = []
        for parcel in self.queue:
            is_due = parcel.due <= step[parcel.batch.world]
            due = parcel if is_due.all() else parcel.select(is_due)
            if due.batch.n:
                for inbox in self.inboxes:
                    inbox.parcels.append(due)
            if not is_due.all():
                waiting.append(parcel.select(~is_due))
        self.queue = waiting

    def drop_worlds(self, gone: np.ndarray) -> None:
        """Discard all messages of the worlds where gone, (n_worlds,), is true."""
        self.sent = [batch.take(np.flatnonzero(~gone[batch.world])) for batch in self.sent]
        self.sent = [batch for batch in self.sent if batch.n]
        self._joined = None
        self.queue = _without(self.queue, gone)
        for inbox in self.inboxes:
            inbox.parcels = _without(inbox.parcels, gone)


def _without(parcels: list[Parcel], gone: np.ndarray) -> list[Parcel]:
    kept = []
    for parcel in parcels:
        stays = ~gone[parcel.batch.world]
        if stays.all():
            kept.append(parcel)
        elif stays.any():
            kept.append(parcel.select(stays))
    return kept


class Inbox:
    """The receiving end of a topic at one plugin: the messages that arrived since the plugin's last call."""

    def __init__(self, topic: TopicBuffer, view: Any = None) -> None:
        self.topic = topic
        self.view = view
        self.parcels: list[Parcel] = []
        if view is None or not getattr(view, "is_subset", False):
            topic.inboxes.append(self)

    def __bool__(self) -> bool:
        return bool(self.parcels)

    @property
    def messages(self) -> Batch:
        """All messages that arrived, for any receiver."""
        return (
            Batch.concatenate([p.batch for p in self.parcels])
            if self.parcels
            else Batch.empty(self.topic.type)
        )

    def pairs(self) -> tuple[np.ndarray, Batch]:
        """(row, messages): one item per receiving row of the group and message, ordered by row, arrival and sender.

        Messages to everyone make rows x messages items; `latest` and `by_row` avoid this.
        """
        rows, batches = [], []
        for parcel in self.parcels:
            row, number = self._receivers(parcel) if parcel.to != EVERYONE else self._broadcast_pairs(parcel)
            rows.append(row)
            batches.append(parcel.batch.take(number))
        if not rows:
            return np.zeros(0, np.int64), Batch.empty(self.topic.type)
        row = np.concatenate(rows)
        order = np.argsort(row, kind="stable")
        return row[order], Batch.join(batches).take(order)

    def latest(self) -> tuple[np.ndarray, Batch]:
        """(row, messages): the last message of each row that received one."""
        view = self.view
        found_in, number = np.full(view.n, -1), np.zeros(view.n, np.int64)
        for k in range(len(self.parcels) - 1, -1, -1):
            parcel = self.parcels[k]
            if parcel.to == EVERYONE:
                first, last = self._broadcast_range(parcel)
                rows, numbers = np.flatnonzero(last > first), last[last > first] - 1
            else:
                rows, numbers = self._receivers(parcel)
            is_new = found_in[rows] < 0
            found_in[rows[is_new]] = k
            number[rows[is_new]] = numbers[is_new]  # of several for one row, the last one stays
        rows = np.flatnonzero(found_in >= 0)
        parts = [(rows[found_in[rows] == k], p.batch) for k, p in enumerate(self.parcels)]
        parts = [(mine, batch) for mine, batch in parts if len(mine)]
        if not parts:
            return rows, Batch.empty(self.topic.type)
        together = Batch.join([batch.take(number[mine]) for mine, batch in parts])
        return rows, together.take(np.argsort(np.concatenate([mine for mine, _ in parts])))

    def by_row(self) -> Callable[[int], list[tuple[Batch, int]]]:
        """A function that returns the messages of a row, ordered by arrival and sender, each as (batch, message number)."""
        parts: list[tuple[Batch, np.ndarray, np.ndarray, np.ndarray | None]] = []
        for parcel in self.parcels:
            if parcel.to == EVERYONE:
                parts.append((parcel.batch, *self._broadcast_range(parcel), None))
            else:
                row, number = self._receivers(parcel)
                edges = np.searchsorted(row, np.arange(self.view.n + 1))
                parts.append((parcel.batch, edges[:-1], edges[1:], number))

        def of(row: int) -> list[tuple[Batch, int]]:
            return [
                (batch, i if number is None else int(number[i]))
                for batch, first, last, number in parts
                for i in range(first[row], last[row])
            ]

        return of

    def _broadcast_range(self, parcel: Parcel) -> tuple[np.ndarray, np.ndarray]:
        """Range of the messages to everyone that each row receives, (n,): those of its world, if it was born by then."""
        view, sent = self.view, parcel.batch.world
        first, last = np.searchsorted(sent, view.world), np.searchsorted(sent, view.world, side="right")
        # The messages of one world in one parcel were delivered together.
        was_born = (last > first) & (view.born <= parcel.due[np.minimum(first, len(sent) - 1)])
        return first, np.where(was_born, last, first)

    def _broadcast_pairs(self, parcel: Parcel) -> tuple[np.ndarray, np.ndarray]:
        """(row, message number) for each row and message to everyone that it receives, by row."""
        first, last = self._broadcast_range(parcel)
        n = last - first
        row = np.repeat(np.arange(len(n)), n)
        return row, np.arange(len(row)) - np.repeat(np.cumsum(n) - n - first, n)

    def _receivers(self, parcel: Parcel) -> tuple[np.ndarray, np.ndarray]:
        """(row, message number) of messages that are not to everyone, by row."""
        view, batch = self.view, parcel.batch
        number, ids = (np.arange(batch.n), batch.sender) if isinstance(parcel.to, str) else parcel.to
        row = view.bodies_rows(batch.world[number], ids) - view.first
        here = np.flatnonzero((row >= 0) & (row < view.n))
        here = here[np.argsort(row[here], kind="stable")]
        return row[here], number[here]

    def clear(self, heard: np.ndarray | None = None) -> None:
        """Discard the messages that were read: those of the worlds where `heard`, (n_worlds,), is true, by default of all."""
        self.parcels = [] if heard is None or heard.all() else _without(self.parcels, heard)


class Publisher:
    """The sending end of a topic at one plugin."""

    def __init__(self, topic: TopicBuffer, view: Any) -> None:
        self.topic = topic
        topic.is_published = True
        self.view = view

    def publish(self, rows: Any, **fields: Any) -> None:
        """Send one message from each of `rows`; fields are scalars, (n,) or (k, n)."""
        rows = np.atleast_1d(np.asarray(rows))
        rows = np.flatnonzero(rows) if rows.dtype == bool else rows
        if len(rows):
            view = self.view
            self.topic.add(Batch.make(self.topic.type, view.world[rows], view.id[rows], fields))
