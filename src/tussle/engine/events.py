"""Tells those who listen what happens in a game; when nobody does, nothing is done for it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from tussle.api.bodies import Bodies
from tussle.api.context import Context
from tussle.api.world import WorldView
from tussle.messages import EntityCaptured, EntityCollided, EntityHitGround, Message
from tussle.record import Events as Happenings
from tussle.record.events import BIRTH, CAPTURE, COLLISION, DEATH, END

TOLD: dict[type[Message], tuple[str, str, str, str]] = {
    EntityCaptured: (CAPTURE, "source", "target", ""),
    EntityCollided: (COLLISION, "first", "second", ""),
    EntityHitGround: (COLLISION, "entity", "", "ground"),
}
"""Message types that are told of: kind, the fields that are its id and other ("" for nobody), and its text."""


class Listeners:
    """Who is told of births, deaths, captures, collisions and ends, as `Happenings`; true while somebody is.

    Attributes:
        is_replaying: These steps have been told of, and are not told again.
        on_change: Called when somebody begins or ends to listen.
    """

    def __init__(self, context: Context) -> None:
        self.is_replaying = False
        self.on_change: Callable[[], None] = lambda: None
        self._context = context
        self._listeners: list[Callable[[Happenings], None]] = []
        self._by: dict[tuple[int, int], int] = {}

    def __bool__(self) -> bool:
        return bool(self._listeners)

    def listen(self, listener: Callable[[Happenings], None]) -> None:
        """Tell `listener` from now on."""
        self._listeners.append(listener)
        self.on_change()

    def forget(self, listener: Callable[[Happenings], None]) -> None:
        """Tell it no more; nothing happens if it was not told."""
        if listener in self._listeners:
            self._listeners.remove(listener)
            self.on_change()

    def _tell(
        self,
        kind: str,
        world: np.ndarray,
        step: np.ndarray,
        ids: np.ndarray,
        other: np.ndarray,
        text: list[str],
    ) -> None:
        if self.is_replaying:
            return
        happenings = Happenings(kind, world, step, ids, other, text)
        for listener in list(self._listeners):
            listener(happenings)

    def births(self, new: Bodies) -> None:
        """Entities have come."""
        names = self._context.block_names
        step = self._context.clock.step[new.world]
        self._tell(BIRTH, new.world, step, new.id, np.zeros_like(new.id), [names[b] for b in new.block])

    def messages(self, view: WorldView) -> None:
        """Captures and collisions of this step, which lie in the outboxes."""
        if self._by:
            self._by.clear()
        for type_ in TOLD:
            for topic in view.by_type.get(type_, ()):
                if topic.sent:
                    self._tell_messages(view, type_)
                    break

    def _tell_messages(self, view: WorldView, type_: type[Message]) -> None:
        kind, first, second, text = TOLD[type_]
        batch = view.inbox(type_)
        one = batch.data[first]
        two = batch.data[second] if second else np.zeros_like(one)
        self._tell(kind, batch.world, self._context.clock.step[batch.world], one, two, [text] * batch.n)
        if not second:
            return
        for world, a, b in zip(batch.world.tolist(), one.tolist(), two.tolist(), strict=True):
            self._by.setdefault((world, b), a)
            if kind == COLLISION:
                self._by.setdefault((world, a), b)

    def deaths(self, bodies: Bodies, deaths: list[tuple[np.ndarray, str]], step: np.ndarray) -> None:
        """Rows of the body table are about to go; the first reason counts.

        Args:
            bodies: The table.
            deaths: (rows, why).
            step: Step of each world in which it happened, (n_worlds,).
        """
        number = np.repeat(np.arange(len(deaths)), [len(rows) for rows, _ in deaths])
        rows, first = np.unique(np.concatenate([rows for rows, _ in deaths]), return_index=True)
        order = np.lexsort((bodies.id[rows], bodies.world[rows]))
        rows, why = rows[order], [deaths[i][1] for i in number[first[order]]]
        world, ids = bodies.world[rows], bodies.id[rows]
        by = [self._by.get(key, 0) for key in zip(world.tolist(), ids.tolist(), strict=True)]
        self._tell(DEATH, world, step[world], ids, np.array(by, np.int64), why)

    def end(self, world: int, reason: str) -> None:
        """A world has ended; its last rows are parked."""
        numbers, none = np.array([world]), np.zeros(1, np.int64)
        self._tell(END, numbers, self._context.clock.step[numbers], none, none, [reason])
