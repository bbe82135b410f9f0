"""Time of the wall against simulated time: how long to wait, how fast it went, what may be spent beside the game."""

from __future__ import annotations

import math
import time
from collections import deque
from typing import Any

from tussle.errors import ParameterError

MOST_LAG = 0.25
"""Time of the wall by which a game may be late and still make up for it [s]; one that is later starts counting anew."""
WINDOW = 1.0
"""Time of the wall over which speed is measured [s]."""
MOMENT = 0.0005
"""Least time between two looks at what has been saved [s]."""
TICK = 0.05
"""Least time between two readings of the speedometer [s]."""


class Pace:
    """Says how long to wait so that simulated time goes `warp` times as fast as the wall's.

    Args:
        warp: Simulated seconds per second; inf is as fast as possible.
    """

    def __init__(self, warp: float) -> None:
        self.warp = warp
        self._anchor: tuple[float, float] | None = None

    def restart(self) -> None:
        """Count anew from the next step."""
        self._anchor = None

    def wait(self, t: float, dt: float) -> float:
        """Time until the step from t to t + dt is due [s]; 0 or less when it is."""
        if math.isinf(self.warp):
            return 0.0
        now = time.perf_counter()
        if self._anchor is None:
            self._anchor = (now, t)
        began, t_began = self._anchor
        left = began + (t + dt - t_began) / self.warp - now
        if left < -MOST_LAG:
            self._anchor = (now, t + dt)
        return left


class Speedometer:
    """How fast a game has gone over the last second of the wall."""

    def __init__(self) -> None:
        self._readings: deque[tuple[float, float, int]] = deque()

    def restart(self) -> None:
        """Forget what was read: the game stands still, or has jumped."""
        self._readings.clear()

    def read(self, t: float, step: int) -> None:
        """Take a reading, unless the last one has just been taken."""
        now = time.perf_counter()
        readings = self._readings
        if readings and now - readings[-1][0] < TICK:
            return
        readings.append((now, t, step))
        while len(readings) > 2 and readings[1][0] < now - WINDOW:
            readings.popleft()

    def speed(self) -> tuple[float, float]:
        """Simulated seconds per second, and steps per second; 0 for a game that stands still."""
        readings = list(self._readings)
        if len(readings) < 2:
            return 0.0, 0.0
        (began, t0, step0), (now, t, step) = readings[0], readings[-1]
        return (t - t0) / (now - began), (step - step0) / (now - began)


class Allowance:
    """What may be spent beside the game: a share of its thread's CPU time and of its rest, saved up to a point.

    CPU time, since on a machine with much else to do a share of the wall's would be a larger share of the game's. It begins with
    what a quarter of a second brings.

    Args:
        share: Of that time.
    """

    def __init__(self, share: float) -> None:
        self.share = share
        self.cost = 0.0
        self._saved = 0.25 * share
        self._last = time.thread_time()
        self._look_at = 0.0

    def rest(self, seconds: float) -> None:
        """The game has waited on purpose: nobody is kept waiting by what is done in that time."""
        self._save(seconds)
        self._look_at = 0.0

    def _save(self, seconds: float) -> None:
        self._saved = min(self._saved + self.share * seconds, 4.0 * self.cost + self.share)

    def allows(self) -> bool:
        """Whether what it cost last time can be paid for by now."""
        # The thread's clock takes longer to read than the wall's, and little is saved in a moment.
        wall = time.perf_counter()
        if wall < self._look_at:
            return False
        now = time.thread_time()
        self._save(max(0.0, now - self._last))  # another thread's clock stands elsewhere
        self._last = now
        if self._saved >= self.cost:
            return True
        self._look_at = wall + MOMENT
        return False

    def pay(self, seconds: float) -> None:
        """It has been done, and took this long."""
        self.cost = seconds
        self._saved -= seconds


def checked_warp(warp: Any) -> float:
    """A warp as a number; None is as fast as possible.

    Raises:
        ParameterError: It is not a number > 0.
    """
    if warp is None:
        return math.inf
    if isinstance(warp, bool) or not isinstance(warp, (int, float)) or not warp > 0.0:
        raise ParameterError(
            f"warp = {warp!r} is not allowed; it takes a number > 0, or None for as fast as possible"
        )
    return float(warp)


def faster(warp: float) -> float:
    """The next warp up: doubled below 2, then one more."""
    return 2.0 * warp if warp < 2.0 else warp + 1.0


def slower(warp: float, reached: float) -> float:
    """The next warp down: one less above 2, then halved; from as fast as possible, what had been reached."""
    if math.isinf(warp):
        return max(1.0, float(math.floor(reached)))
    return 0.5 * warp if warp <= 2.0 else max(warp - 1.0, 1.0)
