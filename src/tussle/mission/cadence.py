"""When a plugin with a rate is due."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any, Self

from tussle.errors import MissionError

FINEST = 1_000_000
"""Largest denominator of calls per grid point. 10 Hz at dt = 1/120 is 1/12 of a call per step, though neither number is exact."""


@dataclass(frozen=True)
class Cadence:
    """The k-th point of the grid on which a plugin is called is due where floor(k p / q) grows, in whole numbers: exact for ever.

    Attributes:
        per_point: Calls per point of the grid, p / q < 1.
        n_substeps: Points of the grid per step.
    """

    per_point: Fraction
    n_substeps: int

    @classmethod
    def of(cls, plugin: Any, most: float, n_substeps: int, where: str) -> Self | None:
        """The cadence of a plugin; None where it is called at every point.

        Args:
            plugin: The plugin, with its `rate` [Hz].
            most: Points of its grid per second [Hz].
            n_substeps: Points of its grid per step.
            where: What it belongs to, for the message.

        Raises:
            MissionError: The rate is higher than that of the grid, or so low that it cannot be told from never.
        """
        if plugin.rate is None:
            return None
        per_point = Fraction(min(plugin.rate / most, 2.0)).limit_denominator(FINEST)
        name = f"{where}: {plugin.instance_name}: rate = {plugin.rate!r} Hz"
        if per_point > 1:
            raise MissionError(
                f"{name} cannot be honoured; the largest that can is {most:g} Hz, one call in every "
                + ("step" if n_substeps == 1 else "substep")
            )
        if per_point == 0:
            raise MissionError(f"{name} cannot be honoured; the smallest that can is {most / FINEST:g} Hz")
        return None if per_point == 1 else cls(per_point, n_substeps)

    def since(self, step: int, substep: int = 0) -> int:
        """Points of the grid since the last call where this one is due (before the first call, a whole period's), else 0."""
        p, q = self.per_point.numerator, self.per_point.denominator
        k = step * self.n_substeps + substep
        number = k * p // q
        if k and number == (k - 1) * p // q:
            return 0
        return k + (1 - number) * q // p
