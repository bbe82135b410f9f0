"""Speeds of a game: those that are set, the one that is measured, and the CPU time that is left for other work."""

from __future__ import annotations

import math
import time
from collections import deque
from typing import Any

from tussle.errors import ParameterError

WINDOW = 1.0
"""Wall time over which speed is measured [s]."""
MOMENT = 0.0005
"""Least time between two checks of the saved CPU time [s]."""
TICK = 0.05
"""Least time between two readings of the speed [s]."""


class Speedometer:
    """Speed of a game over the last second."""

    def __init__(self) -> None:
        self._readings: deque[tuple[float, float, int]] = deque()

    def restart(self) -> None:
        """Drop the readings."""
        self._readings.clear()

    def read(self, t: float, step: int) -> None:
        """Take a reading, at most every `TICK` seconds."""
        now = time.perf_counter()
        readings = self._readings
        if readings and now - readings[-1][0] < TICK:
            return
        readings.append((now, t, step))
        while len(readings) > 2 and readings[1][0] < now - WINDOW:
            readings.popleft()

    def speed(self) -> tuple[float, float]:
        """Simulated seconds and steps per second; 0 for a paused game."""
        readings = list(self._readings)
        if len(readings) < 2:
            return 0.0, 0.0
        (began, t0, step0), (now, t, step) = readings[0], readings[-1]
        return (t - t0) / (now - began), (step - step0) / (now - began)


class Allowance:
    """Limits other work to a share of the thread's CPU time and of its waiting time, saved up to a limit.

    CPU time, since on a busy machine a share of wall time would be a larger share of the game's time. It begins with the share of
    a quarter of a second.

    Args:
        share: The share, 0 to 1.
    """

    def __init__(self, share: float) -> None:
        self.share = share
        self.cost = 0.0
        self._saved = 0.25 * share
        self._last = time.thread_time()
        self._look_at = 0.0

    def rest(self, seconds: float) -> None:
        """Add the share of a waiting time [s]."""
        self._save(seconds)
        self._look_at = 0.0

    def _save(self, seconds: float) -> None:
        self._saved = min(self._saved + self.share * seconds, 4.0 * self.cost + self.share)

    def allows(self) -> bool:
        """Return True if the last cost has been saved."""
        # The thread's clock takes longer to read than the wall clock.
        wall = time.perf_counter()
        if wall < self._look_at:
            return False
        now = time.thread_time()
        self._save(max(0.0, now - self._last))  # clocks of threads differ
        self._last = now
        if self._saved >= self.cost:
            return True
        self._look_at = wall + MOMENT
        return False

    def pay(self, seconds: float) -> None:
        """Subtract the cost of the work [s]."""
        self.cost = seconds
        self._saved -= seconds


def checked_warp(warp: Any, name: str = "warp") -> float:
    """A warp as a number; None is as fast as possible. `name` is that of the argument, for the error.

    Raises:
        ParameterError: It is not a number > 0.
    """
    if warp is None:
        return math.inf
    if isinstance(warp, bool) or not isinstance(warp, (int, float)) or not warp > 0.0:
        raise ParameterError(
            f"{name} = {warp!r} is not allowed; it takes a number > 0, or None for as fast as possible"
        )
    return float(warp)


def faster(warp: float) -> float:
    """The next warp up: doubled below 2, then one more."""
    return 2.0 * warp if warp < 2.0 else warp + 1.0


def slower(warp: float, reached: float) -> float:
    """The next warp down: one less above 2, then halved; from as fast as possible, the speed that was reached."""
    if math.isinf(warp):
        return max(1.0, float(math.floor(reached)))
    return 0.5 * warp if warp <= 2.0 else max(warp - 1.0, 1.0)
