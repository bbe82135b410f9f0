"""The part of the panel that steers time: buttons, speed, the time line and its events."""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from typing import Any

from tussle.view.frame import Frame, Happening
from tussle.view.page.failures import Safe
from tussle.view.page.source import Source

MARKED = ("capture", "collision", "death", "birth", "difference", "end")
"""Kinds of events on the time line; those before count for more where not all have room."""
MOST_EVENTS = 150
"""In the list of events: a longer one is not read."""
MOST_MARKS = 60
"""On the time line, which is a few hundred pixels long."""
NO_EVENT = "–"
TRANSPORT_ORDER = 1.0
TICK = 0.01
"""Of the time line [s]."""


class TimePanel:
    """Buttons, the time line and the list of events.

    Args:
        gui: The server's panel.
        source: The game.
        safe: Makes callbacks whose errors are told.
    """

    def __init__(self, gui: Any, source: Source, safe: Safe) -> None:
        self._source, self._safe = source, safe
        self._run = gui.add_button_group("Run", ("Back", "Pause", "Step"), order=TRANSPORT_ORDER)
        speed = gui.add_button_group("Speed", ("Slower", "1 ×", "Faster", "Max"), order=TRANSPORT_ORDER + 0.1)
        first, last = self._ends()
        self._slider = gui.add_slider(
            "Time [s]", first, last, TICK, float(source.span[0]), marks=marks(source),
            order=TRANSPORT_ORDER + 0.2,
        )  # fmt: skip
        self._list = gui.add_dropdown(
            "Event", (NO_EVENT,), initial_value=NO_EVENT, order=TRANSPORT_ORDER + 0.3
        )
        leap = gui.add_button_group("Jump", ("Last event", "Next event"), order=TRANSPORT_ORDER + 0.4)
        self._listed: dict[str, float] = {}
        self._n_known = -1
        self._wired(speed, leap)

    def _wired(self, speed: Any, leap: Any) -> None:
        source = self._source

        def told_run(_: Any) -> None:
            # By its name, not a toggle: who pressed Pause meant it, whatever has happened meanwhile.
            does = {
                "Back": source.step_back,
                "Step": source.step,
                "Play": source.resume,
                "Pause": source.pause,
            }
            does[self._run.value]()

        self._run.on_click(self._safe(told_run))

        def told_speed(_: Any) -> None:
            if speed.value in ("1 ×", "Max"):
                source.warp = 1.0 if speed.value == "1 ×" else None
            else:
                (source.faster if speed.value == "Faster" else source.slower)()

        speed.on_click(self._safe(told_speed))

        def told_slider(event: Any) -> None:
            if event.client is not None:
                first, last = source.span
                source.seek(min(max(float(self._slider.value), first), last))

        self._slider.on_update(self._safe(told_slider))

        def told_list(event: Any) -> None:
            if event.client is not None and self._list.value in self._listed:
                source.seek(self._listed[self._list.value])

        self._list.on_update(self._safe(told_list))

        def told_leap(_: Any) -> None:
            self.to_event(is_next=leap.value == "Next event")

        leap.on_click(self._safe(told_leap))

    def to_event(self, is_next: bool) -> None:
        """Go to the next event of the time line, or the one before."""
        times = sorted(
            {h.t for h in self._source.happenings if h.kind in MARKED and h.t > self._source.span[0]}
        )
        t = self._source.t
        place = bisect_right(times, t + 1e-9) if is_next else bisect_left(times, t - 1e-9) - 1
        if 0 <= place < len(times):
            self._source.seek(times[place])

    def _ends(self) -> tuple[float, float]:
        """Ends of the slider [s]: of the game, rounded to the outside, as a browser rounds what it sends."""
        first, last = self._source.span
        low = math.floor(first / TICK + 1e-6) * TICK
        return low, max(math.ceil(last / TICK - 1e-6) * TICK, low + TICK)

    def show(self, frame: Frame) -> None:
        """The time of a frame, and the events there are by now."""
        first = self._source.span[0]
        low, last = self._ends()
        # Never a value outside the range, whichever message comes first.
        self._slider.max = max(self._slider.max, last)
        self._slider.value = min(max(frame.t, low), last)
        self._slider.max = min(self._slider.max, last)
        standing = "Play" if self._source.is_paused or self._source.is_over else "Pause"
        if self._run.options[1] != standing:
            self._run.options = ("Back", standing, "Step")
        happenings = self._source.happenings
        if len(happenings) != self._n_known:
            self._n_known = len(happenings)
            self._show_events([h for h in happenings if h.t > first or h.kind != "birth"])

    def _show_events(self, happenings: Sequence[Happening]) -> None:
        shown = chosen_events(happenings, MOST_EVENTS)
        self._listed = {f"{i + 1}. {event_text(h)}": h.t for i, h in enumerate(shown)}
        left_out = sum(h.kind in MARKED for h in happenings) - len(shown)
        title = f"{len(shown)} events" + (f", {left_out:,} more" if left_out else "")
        self._list.options = (title if shown else NO_EVENT, *self._listed)
        self._list.value = title if shown else NO_EVENT


def chosen_events(happenings: Sequence[Happening], most: int) -> list[Happening]:
    """Events for the time line in order of time: of too many, kinds that come first in `MARKED` go first, later ones stay out."""
    ranked = sorted((h for h in happenings if h.kind in MARKED), key=lambda h: (MARKED.index(h.kind), h.t))
    return sorted(ranked[:most], key=lambda h: h.t)


def event_text(happening: Happening) -> str:
    """An event in a line: "12.30 s  capture  31 → 4"."""
    who = {0: ""}.get(happening.id, str(happening.id))
    other = f" → {happening.other}" if happening.other else ""
    return f"{happening.t:.2f} s  {happening.kind}  {who}{other}  {happening.text}".strip()


def marks(source: Source) -> tuple[float, ...] | None:
    """Where the time line of a recorded run is marked: at its events, evenly thinned.

    That of a live game has no marks, since viser takes them only when a slider is made.
    """
    first = source.span[0]
    times = sorted({h.t for h in source.happenings if h.kind in MARKED and h.t > first})
    stride = max(1, math.ceil(len(times) / MOST_MARKS))
    return tuple(times[::stride]) or None
