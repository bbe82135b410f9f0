"""What the browsers see of a live game: its newest state, or over a slow link one that is some time old."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Collection
from dataclasses import dataclass, field

from tussle.engine.result import WorldResult
from tussle.view.alarms import SpecificationState
from tussle.view.drawn import Shape
from tussle.view.entity import EntityState
from tussle.view.feed import TopicTraffic
from tussle.view.frame import Event, Frame
from tussle.view.live import Live

MAX_KEPT = 100
"""Moments that are kept on their way to the browsers: what is seen is late by the delay and at most 1/100 of it."""


@dataclass(frozen=True)
class SeenDetails:
    """What is read less often than a frame.

    Attributes:
        result: The provisional result; None before the first.
        alarms: State of the specifications.
        feed: Messages of the game, where somebody reads them.
        entities: Id -> state, of those that somebody has chosen.
    """

    result: WorldResult | None = None
    alarms: list[SpecificationState] = field(default_factory=list)
    feed: list[TopicTraffic] = field(default_factory=list)
    entities: dict[int, EntityState | None] = field(default_factory=dict)


@dataclass(frozen=True)
class SeenMoment:
    """All that is seen at one time; nothing of it is younger.

    Attributes:
        t: The time [s].
        step: The step that begins with it.
        epoch: Jumps in time before it.
        span: First and last simulated time [s].
        is_over: The game is over.
        frame: The entities.
        shapes: What plugins drew.
        details: All else.
    """

    t: float
    step: int
    epoch: int
    span: tuple[float, float]
    is_over: bool
    frame: Frame
    shapes: tuple[Shape, ...]
    details: SeenDetails


class SeenGame:
    """A live game as the browsers see it, `Live.see` seconds of the game late; all of it when the game is over.

    After the beginning and after a jump in time, the first state is seen until it is that old.

    Args:
        live: The game.
    """

    def __init__(self, live: Live) -> None:
        self._live = live
        self._details = SeenDetails()
        self._kept: deque[SeenMoment] = deque()

    @property
    def now(self) -> SeenMoment:
        """What is seen now."""
        if not self._kept:
            self.look()
        return self._kept[0]

    @property
    def is_late(self) -> bool:
        """Whether something of the game is not seen yet."""
        return self._live.see > 0.0 and not self.now.is_over

    def look(
        self, chosen: Collection[int] = (), *, has_feed: bool = False, has_details: bool = False
    ) -> None:
        """Read the game, and go on to what is seen now.

        Args:
            chosen: Entities whose state is read.
            has_feed: Whether messages are read.
            has_details: Whether details are read; otherwise they are those of before.
        """
        live = self._live
        if has_details:
            feed = live.messages() if has_feed else []
            self._details = SeenDetails(
                live.result(), live.alarms(), feed, {who: live.entity(who) for who in chosen}
            )
        epoch, frame, shapes = live.epoch, live.frame(), live.shapes()
        is_over = live.is_over
        # The time last: nothing that has been read is younger.
        moment = SeenMoment(live.t, live.step_number, epoch, live.span, is_over, frame, shapes, self._details)
        self.keep(moment, 0.0 if is_over else live.see)

    def keep(self, moment: SeenMoment, late: float) -> None:
        """Add the newest moment, and drop those that are not seen any more.

        Args:
            moment: It.
            late: How old what is seen is [s].
        """
        kept = self._kept
        if kept and (moment.epoch != kept[-1].epoch or moment.t < kept[-1].t):
            kept.clear()
        if kept and moment.t == kept[-1].t:
            kept[-1] = moment  # it has more details
        elif not kept or moment.t - kept[-1].t >= late / MAX_KEPT:
            kept.append(moment)
        while len(kept) > 1 and kept[1].t <= moment.t - late:
            kept.popleft()

    def events(self) -> list[Event]:
        """The events that are seen."""
        found = self._live.events
        return [event for event in found if event.t < self.now.t] if self.is_late else found

    def last_step(self) -> float:
        """The last step whose quantities are seen; inf for all."""
        return self.now.step if self.is_late else math.inf
