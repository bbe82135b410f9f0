"""The rule by which a batch ends when a result is known to within a given width."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

from tussle.batch.quantities import Quantity
from tussle.batch.statistics import LEVEL, wilson
from tussle.errors import ParameterError

MIN_RUNS = 20
"""With fewer runs a standard deviation is too uncertain to stop by."""

TAKES = (
    "it takes WIDTH for the wins of all teams, QUANTITY:WIDTH, or 'width(QUANTITY) < WIDTH', such as 0.02, score[2]:0.5 or "
    "'width(wins[2]) < 0.02'"
)
SIGN = re.compile(r":|±|\+/?-")
"""Stands before the width; ± and its spellings are those of earlier versions."""
Columns = Mapping[str, np.ndarray]


@dataclass(frozen=True)
class Until:
    """Half the width that the 95 % interval of a result is to have at each point.

    Attributes:
        quantity: The result; None for the wins of every team.
        half_width: Of the interval.
    """

    quantity: Quantity | None
    half_width: float

    @staticmethod
    def parse(text: str) -> Until:
        """Read "0.02" or "score[2]:0.5".

        Raises:
            ParameterError: It is written otherwise, or asks for an impossible width.
        """
        signs = list(SIGN.finditer(text))
        name, number = (text[: signs[-1].start()], text[signs[-1].end() :]) if signs else ("", text)
        name, number = name.strip(), number.strip()
        try:
            half_width = float(number)
        except ValueError:
            hint = "; a share of 2 % is written 0.02" if number.endswith("%") else ""
            raise ParameterError(f"until {text!r}: {number!r} is no number{hint}; {TAKES}") from None
        if not 0.0 < half_width < math.inf:
            raise ParameterError(f"until {text!r}: the width {number} is not allowed; it takes a number > 0")
        quantity = Quantity.parse(name) if name else None
        if half_width >= 0.5 and (quantity is None or quantity.is_share):
            raise ParameterError(
                f"until {text!r}: shares lie between 0 and 1, so the width {number} says nothing; 2 % is written 0.02"
            )
        return Until(quantity, half_width)

    def is_met(self, columns_by_point: Iterable[Columns]) -> bool:
        """Return True if the interval is narrow enough at every point.

        Args:
            columns_by_point: For each point, name -> value for each of its runs, (n,); NaN where a run failed.

        Raises:
            ParameterError: The runs have no such result.
        """
        return all(self.width(columns) <= self.half_width for columns in columns_by_point)

    def width(self, columns: Columns) -> float:
        """Half the width of the interval at one point, of several results the widest; infinite for less than 20 runs.

        Args:
            columns: Name -> value for each run, (n,); NaN where it failed.

        Raises:
            ParameterError: The runs have no such result.
        """
        if not any(np.isfinite(values).any() for values in columns.values()):
            return math.inf
        if self.quantity is not None:
            return _half(self.quantity.evaluate(columns), self.quantity.is_share)
        wins = [values for name, values in columns.items() if name.startswith("wins[")]
        if not wins:
            raise ParameterError(
                f"until {self}: these games have no scores, so nobody wins; name a quantity, as in t:0.5"
            )
        return max(_half(values, is_share=True) for values in wins)

    def check(self, columns: Columns) -> None:
        """See that runs have the result.

        Raises:
            ParameterError: They have not.
        """
        self.width(columns)

    def __str__(self) -> str:
        return f"{self.quantity}:{self.half_width!r}" if self.quantity else repr(self.half_width)


def _half(values: np.ndarray, is_share: bool) -> float:
    """Half of Wilson's interval of a share, or of the normal interval of a mean."""
    known = values[np.isfinite(values)]
    n = len(known)
    if n < MIN_RUNS:
        return math.inf
    if is_share:
        low, high = wilson(float(known.sum()), n)
        return (high - low) / 2.0
    return NormalDist().inv_cdf(0.5 + LEVEL / 2.0) * float(known.std(ddof=1)) / math.sqrt(n)
