"""A topic: what was published in this step, what is on its way, and who has heard what."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from tussle.messages import Batch, Message

EVERYONE: Final = "everyone"
SAME_ENTITY: Final = "same entity"


@dataclass(slots=True)
class Parcel:
    """Messages with their receivers and the step in which they are due.

    Attributes:
        batch: The messages.
        due: Step at whose end each is delivered, (n,).
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
        inboxes: Receiving ends.
    """

    def __init__(self, network: str, name: str, type_: type[Message]) -> None:
        self.network = network
        self.name = name
        self.type = type_
        self.sent: list[Batch] = []
        self.queue: list[Parcel] = []
        self.inboxes: list[Inbox] = []
        self._joined: Batch | None = None

    def add(self, batch: Batch) -> None:
        """Put messages into this step's outbox."""
        if batch.n:
            self.sent.append(batch)
            self._joined = None

    def outbox(self) -> Batch:
        """All that was published in this step, ordered by (world, sender)."""
        if self._joined is None or self._joined.n == 0:
            self._joined = Batch.concatenate(self.sent) if self.sent else Batch.empty(self.type)
        return self._joined

    def clear_outbox(self) -> None:
        self.sent.clear()
        self._joined = None

    def truncate(self, mark: int) -> None:
        """Forget what was added after `mark` batches: the call that sent it has failed."""
        if len(self.sent) > mark:
            del self.sent[mark:]
            self._joined = None

    def post(self, batch: Batch, to: Any, due: np.ndarray) -> None:
        """Queue messages for delivery."""
        self.queue.append(Parcel(batch, due, to))

    def deliver(self, step: np.ndarray) -> None:
        """Hand over all messages that are due at the end of the worlds' steps, (n_worlds,)."""
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
        """Forget all messages of the worlds where gone, (n_worlds,), is true."""
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
    """The receiving end of a topic at one plugin: what has arrived since the plugin's last call."""

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
        """All messages that arrived, without regard to who hears them."""
        return (
            Batch.concatenate([p.batch for p in self.parcels])
            if self.parcels
            else Batch.empty(self.topic.type)
        )

    def pairs(self) -> tuple[np.ndarray, Batch]:
        """(row, messages): one item per receiving row of the group and message, by row, then arrival, then sender."""
        view = self.view
        rows, batches = [], []
        for parcel in self.parcels:
            batch = parcel.batch
            if isinstance(parcel.to, str) and parcel.to == EVERYONE:
                row, number = _everyone(batch.world, view.world)
                was_born = view.born[row] <= parcel.due[number]  # who comes later has not heard it
                row, number = row[was_born], number[was_born]
            else:
                if isinstance(parcel.to, str):
                    number, ids = np.arange(batch.n), batch.sender
                else:
                    number, ids = parcel.to
                row = view.bodies_rows(batch.world[number], ids) - view.first
                here = (row >= 0) & (row < view.n)
                row, number = row[here], number[here]
            rows.append(row)
            batches.append(batch.take(number))
        if not rows:
            return np.zeros(0, np.int64), Batch.empty(self.topic.type)
        row = np.concatenate(rows)
        batch = Batch.join(batches)
        order = np.argsort(row, kind="stable")
        return row[order], batch.take(order)

    def latest(self) -> tuple[np.ndarray, Batch]:
        """(row, messages): the last message of each row that has heard one."""
        row, batch = self.pairs()
        is_last = np.ones(len(row), bool)
        is_last[:-1] = row[1:] != row[:-1]
        return row[is_last], batch.take(np.flatnonzero(is_last))

    def clear(self, heard: np.ndarray | None = None) -> None:
        """Forget what was read; `heard`, (n_worlds,), names the worlds whose call has been made, all of them by default."""
        self.parcels = [] if heard is None or heard.all() else _without(self.parcels, heard)


def _everyone(sent: np.ndarray, world: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(row, message number) of all rows that share a message's world."""
    row, number = np.nonzero(world[:, None] == sent[None, :])
    return row, number


class Publisher:
    """The sending end of a topic at one plugin."""

    def __init__(self, topic: TopicBuffer, view: Any) -> None:
        self.topic = topic
        self.view = view

    def publish(self, rows: Any, **fields: Any) -> None:
        """Send one message from each of `rows`; fields are scalars, (n,) or (k, n)."""
        rows = np.atleast_1d(np.asarray(rows))
        rows = np.flatnonzero(rows) if rows.dtype == bool else rows
        if len(rows):
            view = self.view
            self.topic.add(Batch.make(self.topic.type, view.world[rows], view.id[rows], fields))
