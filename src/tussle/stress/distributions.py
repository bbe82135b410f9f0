"""Distributions of varied values, written as "prey.Boids.max_speed=normal(10, 2)"."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from tussle.arguments import explained
from tussle.batch.statistics import scipy_package
from tussle.batch.variables import SHOWN_DIGITS, Value, Variable, parse_bounds
from tussle.errors import ParameterError, clipped, listed, nearest_name
from tussle.mission.codecs import written
from tussle.numeric import exp

LAWS = {"normal": "mean, sd", "lognormal": "median, sd of the logarithm", "uniform": "low, high"}
"""Distributions and what they take."""
CALL = re.compile(r"\s*(\w{1,40})\s*\(([^(),]{1,100}),([^(),]{1,100})\)\s*")


@explained
@dataclass(frozen=True)
class Distribution:
    """The distribution of a value of a mission.

    Attributes:
        name: A placeholder of the mission, or a path such as "prey.Boids.max_speed".
        law: normal, lognormal or uniform.
        first: Mean, median or low bound [unit].
        second: Standard deviation [unit], that of the logarithm, or high bound [unit].
        unit: Unit that is written behind the number.
        is_text: It comes from a text, so that a number without unit is read as in a mission file; else it is SI.

    Raises:
        ParameterError: There is no such law, or its numbers are not allowed.
    """

    name: str
    law: str
    first: float
    second: float
    unit: str = ""
    is_text: bool = False

    def __post_init__(self) -> None:
        if self.law not in LAWS:
            raise ParameterError(
                f"{self.name}: there is no distribution {clipped(self.law)!r}{nearest_name(self.law, LAWS)}; {listed(LAWS)}"
            )
        is_wide = self.second > (self.first if self.law == "uniform" else 0.0)
        is_positive = self.law != "lognormal" or self.first > 0.0
        if not (math.isfinite(self.first) and math.isfinite(self.second) and is_wide and is_positive):
            raise ParameterError(
                f"{self.name}: {self.law}({self.first:.12g}, {self.second:.12g}) is not allowed; it takes ({LAWS[self.law]}), finite, "
                "with a positive width, and a positive median"
            )

    def value_at(self, u: float) -> float:
        """The value below which lies what lies below u of a standard normal number; to digits that can be typed."""
        if self.law == "normal":
            value = self.first + self.second * u
        elif self.law == "lognormal":
            value = self.first * float(exp(self.second * u))
        else:
            value = self.first + (self.second - self.first) * float(scipy_package().special.ndtr(u))
        return float(f"{value:.{SHOWN_DIGITS}g}")

    def setting(self, value: float) -> Value:
        """The value as `read_mission` takes it, see `Range.setting`."""
        if self.unit:
            return f"{written(value)} {self.unit}"
        return written(value) if self.is_text else value


def parse_distribution(name: str, text: str) -> Distribution | None:
    """Read a text such as "normal(10, 2)", "normal(20, 3 kt)", "uniform(0, 1)"; None if it is written as something else.

    Raises:
        ParameterError: There is no such distribution, or its numbers are not allowed.
    """
    call = CALL.fullmatch(text)
    if call is None:
        return None
    if call[1] == "lognormal":  # the second number has no unit
        median, _, unit = parse_bounds(name, call[2].strip(), call[2].strip())
        sd, _, _ = parse_bounds(name, call[3].strip(), call[3].strip())
        return Distribution(name, call[1], median, sd, unit, is_text=True)
    return Distribution(name, call[1], *parse_bounds(name, call[2].strip(), call[3].strip()), is_text=True)


def with_distributions(
    vary: Mapping[str, Any] | Iterable[str | Variable | Distribution],
) -> tuple[tuple[Distribution, ...], Mapping[str, Any] | list[str | Variable]]:
    """Distributions among what varies, and the rest as `as_variables` takes it.

    Raises:
        ParameterError: One is not allowed, or a name is there twice.
    """
    found: list[Distribution] = []
    rest: list[Any] = []
    is_named = isinstance(vary, Mapping)
    for item in vary.items() if isinstance(vary, Mapping) else vary:
        name, value = item if isinstance(item, tuple) else ("", item)
        if isinstance(value, str):
            own, text = (name, value) if is_named else (part.strip() for part in value.partition("=")[::2])
            value = parse_distribution(own, text)
        if isinstance(value, Distribution):
            found.append(replace(value, name=name) if is_named else value)
        else:
            rest.append(item)
    names = [each.name for each in found]
    for name in names:
        if names.count(name) > 1:
            raise ParameterError(f"{name} varies twice; give it once")
    return tuple(found), dict(rest) if is_named else rest
