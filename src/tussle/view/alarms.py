"""Alarms of a game that is watched: when a specification comes within a margin of failing, and when it fails."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from tussle.errors import ParameterError
from tussle.view.frame import Event
from tussle.view.series import CurveName, StepSeries


class SpecificationMonitor(Protocol):
    """Reads what a specification speaks of while a simulation is stepped, such as `tussle.stress.Monitor`.

    Attributes:
        text: The specification.
        unit: SI unit of its robustness.
    """

    @property
    def text(self) -> str: ...
    @property
    def unit(self) -> str: ...
    def progress(self, world: int) -> tuple[np.ndarray, np.ndarray, float]:
        """What is known of a world, see `tussle.stress.Monitor.progress`.

        Raises:
            ParameterError: It cannot be computed.
        """
        ...


@dataclass(frozen=True)
class SpecificationState:
    """How far a game is from breaking a specification.

    Attributes:
        text: The specification.
        unit: SI unit of the numbers.
        state: "holds", "near" within the margin, "failed", "open" while nothing is known, or "unknown" if it cannot be computed.
        now: Robustness of the present alone; NaN where that is not known.
        ended: Robustness of the game if it ended now; NaN of a game that was rewound.
        least: The least robustness so far; inf while nothing is known.
        reached: Time at which it was reached [s]; None while nothing is known.
        since: Time from which on it is near, or has failed [s]; None otherwise.
        note: Why it cannot be computed.
    """

    text: str
    unit: str
    state: str
    now: float = math.nan
    ended: float = math.nan
    least: float = math.inf
    reached: float | None = None
    since: float | None = None
    note: str = ""


@dataclass(frozen=True)
class SpecificationCourse:
    """How a game that is known to its end came near to breaking a specification.

    Attributes:
        text: The specification.
        unit: SI unit of the numbers.
        near: Time from which on it is within the margin [s]; None for never.
        failed: Time from which on it has failed [s]; None for never.
        t: Times at which the least robustness so far falls [s].
        least: What it falls to; None for -inf.
        note: Why it cannot be computed.
    """

    text: str
    unit: str
    near: float | None
    failed: float | None
    t: list[float]
    least: list[float | None]
    note: str = ""


class _Watched:
    """One specification, as far as the game was played."""

    def __init__(self, monitor: SpecificationMonitor) -> None:
        self.monitor = monitor
        self.clear()

    def clear(self) -> None:
        self.known = self.present = np.zeros(0)
        self.ended, self.note = math.nan, ""
        self.curve = StepSeries()

    def read(self, world: int, is_over: bool) -> None:
        try:
            self.known, self.present, self.ended = self.monitor.progress(world)
            self.note = ""
        except ParameterError as error:
            self.note = str(error)
            return
        if not np.isfinite(self.present).any():
            return
        # Births of the next step still belong to the present sample, so it is not kept yet.
        for step in range(self.curve.last + 1, len(self.present) - (not is_over)):
            self.curve = self.curve.add(step, float(self.present[step]))

    def forget_after(self, step: int) -> None:
        self.known, self.present = self.known[:step], self.present[:step]
        self.curve = self.curve.until(step - 1)

    def first_below(self, level: float) -> int | None:
        """The first step at which the robustness is known to be below a level."""
        n = int(np.searchsorted(-self.known, -level, side="right"))
        return n if n < len(self.known) else None

    def state_at(self, step: int, margin: float, time_of: Callable[[int], float]) -> SpecificationState:
        text, unit = self.monitor.text, self.monitor.unit
        if self.note or step >= len(self.known):
            return SpecificationState(text, unit, "unknown", note=self.note)
        near, failed = self.first_below(margin), self.first_below(0.0)
        now, least = float(self.present[step]), float(self.known[step])
        state, since = "open" if least == math.inf else "holds", None
        if near is not None and near <= step:
            state, since = "near", time_of(near)
        if failed is not None and failed <= step:
            state, since = "failed", time_of(failed)
        ended = self.ended if step == len(self.known) - 1 else math.nan
        reached = time_of(int(np.searchsorted(-self.known, -least))) if least < math.inf else None
        return SpecificationState(text, unit, state, now, ended, least, reached, since)

    def course(self, margin: float, time_of: Callable[[int], float]) -> SpecificationCourse:
        text, unit = self.monitor.text, self.monitor.unit
        (falls,) = np.nonzero(self.known < np.append(math.inf, self.known[:-1]))
        near, failed = (
            None if step is None else time_of(step) for step in map(self.first_below, (margin, 0.0))
        )
        least = [value if math.isfinite(value) else None for value in self.known[falls].tolist()]
        return SpecificationCourse(
            text, unit, near, failed, list(map(time_of, falls.tolist())), least, self.note
        )


class SpecificationAlarms:
    """Follows specifications in one world that is played, rewound, and played again.

    Args:
        monitors: One for each specification; they see each step of the game.
        margin: Distance from failure below which there is an alarm, in the unit of what is compared.
        world: Number of the world.
        time_of: Time of a step [s].
    """

    def __init__(
        self,
        monitors: Sequence[SpecificationMonitor],
        margin: float,
        world: int,
        time_of: Callable[[int], float],
    ) -> None:
        self._watched, self._margin, self._world = [_Watched(each) for each in monitors], margin, world
        self._time_of = time_of
        self.clear()

    def clear(self) -> None:
        """Forget everything."""
        self._last, self._is_final = -1, False
        for each in self._watched:
            each.clear()

    def forget_after(self, step: int) -> None:
        """Forget a step and all after it: the game takes another course from there."""
        self._last, self._is_final = min(self._last, step - 1), False
        for each in self._watched:
            each.forget_after(step)

    @property
    def series(self) -> dict[CurveName, StepSeries]:
        """Robustness at each step, of specifications of which it is known then."""
        return {CurveName(each.monitor.text): each.curve for each in self._watched if each.curve.values}

    def read(self, step: int, is_over: bool) -> list[SpecificationState]:
        """State of each specification at the present step."""
        if step > self._last or (is_over and not self._is_final):
            self._last, self._is_final = step, is_over
            for each in self._watched:
                each.read(self._world, is_over)
        return [each.state_at(step, self._margin, self._time_of) for each in self._watched]

    @property
    def courses(self) -> list[SpecificationCourse]:
        """What each specification came to, of a game that was read to its end."""
        return [each.course(self._margin, self._time_of) for each in self._watched]

    @property
    def events(self) -> list[Event]:
        """The alarms, in order: "alarm" within the margin, "failure" when a specification has failed."""
        found = []
        for each in self._watched:
            near, failed = each.first_below(self._margin), each.first_below(0.0)
            if near is not None and near != failed:
                found.append(Event(self._time_of(near), "alarm", 0, 0, each.monitor.text))
            if failed is not None:
                found.append(Event(self._time_of(failed), "failure", 0, 0, each.monitor.text))
        return sorted(found, key=lambda each: each.t)
