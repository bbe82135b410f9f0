"""Wall time and simulated time: how long a step waits, whoever paces it."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

MAX_LAG = 0.25
"""Delay up to which a game catches up [s]; a larger delay is dropped."""
POLL_PERIOD = 0.05
"""Longest sleep between two looks for Ctrl-C, for messages or for another thread's answer [s]."""


class Pace:
    """Computes how long to wait so that simulated time passes `warp` times as fast as wall time.

    Args:
        warp: Simulated seconds per second; inf is as fast as possible.
    """

    def __init__(self, warp: float) -> None:
        self.warp = warp
        self._anchor: tuple[float, float] | None = None
        self._last = math.nan

    def restart(self) -> None:
        """Count from the next step."""
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
        if left < -MAX_LAG:
            self._anchor = (now, t + dt)
        return left

    def due_in(self, t: float, dt: float) -> float:
        """Time until t is due [s], where the last call was for t - dt; after a jump of simulated time, it is due at once."""
        if abs(t - dt - self._last) > 1.5 * dt:
            self.restart()
        self._last = t
        return self.wait(t, 0.0)

    def hold(
        self,
        t: float,
        dt: float,
        is_interrupted: Callable[[], object],
        meanwhile: Callable[[], object] = lambda: None,
    ) -> None:
        """Sleep until t is due, or until the user interrupts; see `due_in`. `meanwhile` is called after each sleep."""
        left = self.due_in(t, dt)
        while left > 0.0 and not is_interrupted():
            time.sleep(min(left, POLL_PERIOD))
            meanwhile()
            left = self.wait(t, 0.0)
