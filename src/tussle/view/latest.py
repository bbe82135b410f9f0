"""A value that one thread makes and others read, without waiting for each other."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Generic, TypeVar

T = TypeVar("T")

LINGER = 0.25
"""Time after the last request during which the value is still renewed [s]; ten requests per second always get the newest."""


class LatestValue(Generic[T]):
    """A value that is made only while it is requested, and at a limited rate.

    The maker's thread calls `renew` from time to time; other threads call `take`, which returns the latest value at once.

    Args:
        make: Makes the value, in the maker's thread.
        period: Least time between two values [s].
        ring: Wakes the maker.
    """

    def __init__(self, make: Callable[[], T], period: float, ring: Callable[[], None]) -> None:
        self._make, self._period, self._ring = make, period, ring
        self.value: T | None = None
        self.n_made = 0
        self._version = -1
        self._asked = float("-inf")
        self._due = 0.0

    def take(self) -> T | None:
        """The latest value; None before the first."""
        self._asked = time.monotonic()
        self._ring()
        return self.value

    @property
    def idle_for(self) -> float:
        """Time since the last request [s]."""
        return time.monotonic() - self._asked

    def renew(self, version: int, *, is_still: bool = False, always: bool = False) -> None:
        """Make the value again if it is out of date and requested.

        Args:
            version: Number of changes; the value is made once for each version.
            is_still: Nothing will change soon, so the period need not pass.
            always: Make it without a request.
        """
        if version == self._version:
            return
        now = time.monotonic()
        if not always and (now - self._asked > LINGER or (now < self._due and not is_still)):
            return
        self._version, self._due = version, now + self._period
        self.value = self._make()
        self.n_made += 1
        took = time.monotonic() - now
        self._due = max(self._due, now + 4.0 * took)  # the game has most of the time, however long this takes
