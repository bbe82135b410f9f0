"""Sends frames to the browsers, at a rate of its own, whatever the game and the browsers do."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from functools import partial
from typing import Any

from tussle.view.frame import Frame
from tussle.view.page.display import Display
from tussle.view.page.drawn import Drawn
from tussle.view.page.failures import Failures
from tussle.view.page.labels import Labels
from tussle.view.page.overlays import Overlays
from tussle.view.page.panel import Panel
from tussle.view.page.source import Source
from tussle.view.page.stage import Stage
from tussle.view.page.trails import Trails
from tussle.view.page.visitor import Visitor

PERIOD = 1.0 / 30.0
"""Least time between two frames [s]."""
SLOW_PERIOD = 0.25
"""Of numbers, trails and links, which nobody reads faster [s]."""
NAP = 0.1
"""While nobody watches [s]."""
SHARE_OF_MODEL = 0.3
"""Size of points that plugins draw without a size, of a model's length."""


class Pusher:
    """The thread that draws: takes the newest frame and hands it to viser, which sends to each browser as fast as that one takes it.

    While no browser is there it asks for nothing, so that a game that nobody watches costs nothing.

    Args:
        server: viser's server.
        source: The game.
        display: What is shown.
        parts: Stage, labels, trails, overlays, drawn and panel, by name.
        visitors: Those who watch now.
        failures: Told of what cannot be drawn; the rest is.
        period: Time between two frames [s], no less than `PERIOD`.

    Attributes:
        n_pushed: Frames that were sent.
    """

    def __init__(
        self,
        server: Any,
        source: Source,
        display: Display,
        parts: Parts,
        visitors: Callable[[], list[Visitor]],
        failures: Failures,
        period: float = PERIOD,
    ) -> None:
        self._server, self._source, self._display = server, source, display
        self._parts, self._visitors, self._failures = parts, visitors, failures
        self._period = max(period, PERIOD)
        self.n_pushed = 0
        self._moments: deque[float] = deque(maxlen=64)
        self._seen: Frame | None = None
        self._version = -1
        self._slow_due = 0.0
        self._is_stopping = threading.Event()
        self._thread = threading.Thread(target=self._work, name="tussle page", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End the thread."""
        self._is_stopping.set()
        self._thread.join(5.0)

    @property
    def is_alive(self) -> bool:
        return self._thread.is_alive()

    def _work(self) -> None:
        due = time.monotonic()
        while not self._is_stopping.is_set():
            visitors = self._visitors()
            if visitors:
                with self._failures.caught():
                    self.push(visitors)
                due = max(due + self._period, time.monotonic())
                self._is_stopping.wait(due - time.monotonic())
            else:
                self._is_stopping.wait(NAP)

    def push(self, visitors: list[Visitor]) -> None:
        """Send what is to be seen now."""
        frame = self._source.frame()
        is_new = frame is not self._seen and (
            self._seen is None or frame.step != self._seen.step or frame.t != self._seen.t
        )
        is_slow = time.monotonic() >= self._slow_due
        if is_slow:
            self._slow_due = time.monotonic() + SLOW_PERIOD
        if is_new or self._version != self._display.version:
            self._seen, self._version = frame, self._display.version
            self._draw(frame, visitors)
        # Asked for each time: what was drawn in a step can come a moment after its frame.
        shapes = self._source.shapes() if self._display.has_drawn else ()
        self._each(partial(self._parts.drawn.show, shapes, SHARE_OF_MODEL * self._display.size))
        self._each(*(partial(visitor.camera.follow, frame, visitor.chosen) for visitor in visitors))
        if is_slow:
            parts, notes = self._parts, [*self._parts.drawn.notes, *self._failures.texts]
            self._each(
                partial(parts.trails.show, frame),
                partial(parts.overlays.show_links, frame),
                partial(parts.panel.show, frame, self.rate(), notes),
                *(partial(visitor.show, frame) for visitor in visitors),
            )

    def _draw(self, frame: Frame, visitors: list[Visitor]) -> None:
        parts, chosen = self._parts, {v.chosen for v in visitors if v.chosen is not None}
        with self._server.atomic():
            self._each(
                partial(parts.stage.show, frame),
                partial(parts.overlays.show, frame),
                partial(parts.labels.show, frame, chosen),
            )
        self.n_pushed += 1
        self._moments.append(time.monotonic())

    def _each(self, *draws: Callable[[], None]) -> None:
        """Draw one after the other, whichever of them fails."""
        for draw in draws:
            with self._failures.caught():
                draw()

    def rate(self) -> float:
        """Frames that were sent in the last second."""
        now = time.monotonic()
        return float(sum(now - moment <= 1.0 for moment in list(self._moments)))


class Parts:
    """All that draws.

    Args:
        stage: The entities.
        labels: Their names.
        trails: Where they have been.
        overlays: How far they reach.
        drawn: What plugins draw.
        panel: Numbers and controls.
    """

    def __init__(
        self, stage: Stage, labels: Labels, trails: Trails, overlays: Overlays, drawn: Drawn, panel: Panel
    ) -> None:
        self.stage, self.labels, self.trails = stage, labels, trails
        self.overlays, self.drawn, self.panel = overlays, drawn, panel
