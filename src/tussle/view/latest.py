"""What one thread makes and others take without either waiting for the other."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Generic, TypeVar

T = TypeVar("T")

LINGER = 0.25
"""How long after it was last asked for a thing is still made anew [s]; who asks ten times a second always gets the newest."""


class LatestValue(Generic[T]):
    """A thing that is made only while somebody asks for it, and not too often.

    The maker's thread calls `renew` whenever it has a moment; any other calls `take`, which returns at once what was made last.

    Args:
        make: Makes it, in the maker's thread.
        period: Least time between two of them [s].
        ring: Wakes the maker when it sleeps.
    """

    def __init__(self, make: Callable[[], T], period: float, ring: Callable[[], None]) -> None:
        self._make, self._period, self._ring = make, period, ring
        self.value: T | None = None
        self.n_made = 0
        self._version = -1
        self._asked = float("-inf")
        self._due = 0.0

    def take(self) -> T | None:
        """The newest there is; None before the first."""
        self._asked = time.monotonic()
        self._ring()
        return self.value

    @property
    def idle_for(self) -> float:
        """Time since it was last asked for [s]."""
        return time.monotonic() - self._asked

    def renew(self, version: int, *, is_still: bool = False, always: bool = False) -> None:
        """Make it anew where that is called for.

        Args:
            version: Counts what has changed; of the same version, one is enough.
            is_still: Nothing will change soon: there is no need to wait for the period to pass.
            always: Make it even if nobody has asked.
        """
        if version == self._version:
            return
        now = time.monotonic()
        if not always and (now - self._asked > LINGER or (now < self._due and not is_still)):
            return
        self._version, self._due = version, now + self._period
        self.value = self._make()
        self.n_made += 1
