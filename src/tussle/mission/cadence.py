"""Call schedules of plugins with a rate."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any, Self

from tussle.errors import MissionError

FINEST = 1_000_000
"""Largest denominator of calls per grid point. 10 Hz at dt = 1/120 becomes exactly 1/12, although 1/120 is not exact in float64."""


@dataclass(frozen=True)
class Cadence:
    """Schedule on a grid of points (steps or substeps): point k is due where floor(k p / q) grows. Integers keep it exact.

    Attributes:
        per_point: Calls per point of the grid, p / q < 1.
        n_substeps: Points of the grid per step.
    """

    per_point: Fraction
    n_substeps: int

    @classmethod
    def of(cls, plugin: Any, most: float, n_substeps: int, where: str) -> Self | None:
        """Return the cadence of a plugin; None if it is called at every point.

        Args:
            plugin: The plugin, with its `rate` [Hz].
            most: Points of its grid per second [Hz].
            n_substeps: Points of its grid per step.
            where: Block or "mission", for the error message.

        Raises:
            MissionError: The rate is higher than that of the grid, or lower than `FINEST` can represent.
        """
        if plugin.rate is None:
            return None
        per_point = Fraction(min(plugin.rate / most, 2.0)).limit_denominator(FINEST)
        name = f"{where}: {plugin.instance_name}: rate = {plugin.rate!r} Hz"
        if per_point > 1:
            raise MissionError(
                f"{name} is too high; the maximum is {most:g} Hz, one call per "
                + ("step" if n_substeps == 1 else "substep")
            )
        if per_point == 0:
            raise MissionError(f"{name} is too low; the minimum is {most / FINEST:g} Hz")
        return None if per_point == 1 else cls(per_point, n_substeps)

    def since(self, step: int, substep: int = 0) -> int:
        """Return the number of grid points since the previous call if a call is due, else 0. The first call counts a full period."""
        p, q = self.per_point.numerator, self.per_point.denominator
        k = step * self.n_substeps + substep
        number = k * p // q
        if k and number == (k - 1) * p // q:
            return 0
        return k + (1 - number) * q // p


class TimerCadence:
    """SCRIMMAGE's schedule: a timer from which dt is subtracted at each point, and to which the period is added in each call.

    Args:
        rate: Calls per second [Hz], by the dt of each point.
        dt: Subtracted at each point [s].
        n_substeps: Points of the grid per step.
    """

    def __init__(self, rate: float, dt: float, n_substeps: int) -> None:
        self._period, self._dt, self._n_substeps = 1.0 / rate, dt, n_substeps
        self._timer, self._is_due = 0.0, list[bool]()

    def since(self, step: int, substep: int = 0) -> int:
        """Return 1 if a call is due, else 0."""
        k = step * self._n_substeps + substep
        while len(self._is_due) <= k:
            self._timer -= self._dt
            self._is_due.append(self._timer <= 0.0)
            self._timer += self._period if self._is_due[-1] else 0.0
        return int(self._is_due[k])
