"""How much of something is enough: the smallest value of a variable at which the mean of a quantity reaches a target."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from tussle.batch.quantities import Quantity
from tussle.batch.selection import written
from tussle.batch.sequential_intervals import seen_in, sequential_interval
from tussle.batch.statistics import LEVEL
from tussle.batch.variables import Choice, Range, Variable
from tussle.declare.displays import decimals
from tussle.errors import ParameterError, listed, nearest_name

if TYPE_CHECKING:
    from tussle.batch.response import Response

SIGN = re.compile(r"<=|>=|≤|≥|<|>")
TAKES = "it takes QUANTITY >= NUMBER or QUANTITY <= NUMBER, such as 'wins[2] >= 0.95'"
MAX_PARTS = 8
"""Parts into which values are put together that were drawn with those of other variables."""
MIN_IN_PART = 5
N_FITTED = 121
"""Places at which a fit is looked at."""


@dataclass(frozen=True)
class Target:
    """A bound that the mean of a quantity is to reach.

    Attributes:
        quantity: The quantity.
        is_lower: The mean is to be at least the bound, else at most.
        bound: The number.
    """

    quantity: Quantity
    is_lower: bool
    bound: float

    @staticmethod
    def parse(text: str, word: str = "target") -> Target:
        """Read "Guard.share >= 0.95", "lost[1] / start[1] < 20 %"; less and less or equal are the same for a mean.

        Args:
            text: The text.
            word: What the text is, for messages.

        Raises:
            ParameterError: It is written otherwise.
        """
        signs = list(SIGN.finditer(text))
        if len(signs) != 1:
            raise ParameterError(
                f"{word} {text!r:.200}: there is {'no' if not signs else 'more than one'} sign of comparison; {TAKES}"
            )
        name, number = text[: signs[0].start()].strip(), text[signs[0].end() :].strip()
        try:
            bound = float(number.removesuffix("%")) / (100.0 if number.endswith("%") else 1.0)
        except ValueError:
            bound = math.nan
        if not math.isfinite(bound):
            raise ParameterError(f"{word} {text!r}: {number!r} behind the sign is no finite number; {TAKES}")
        if not name:
            raise ParameterError(f"{word} {text!r}: there is no quantity before the sign; {TAKES}")
        return Target(Quantity.parse(name), signs[0][0] in (">", ">=", "≥"), bound)

    def __str__(self) -> str:
        return f"{self.quantity} {'>=' if self.is_lower else '<='} {self.bound!r}"

    def is_reached(self, mean: float) -> bool:
        """Return True if a mean is on the right side of the bound."""
        return mean >= self.bound if self.is_lower else mean <= self.bound

    def state(self, low: float, high: float) -> str:
        """What is known if the mean lies between two numbers: "reached", "missed" or "open"."""
        is_reached = {self.is_reached(low), self.is_reached(high)}
        return "open" if len(is_reached) > 1 else "reached" if is_reached.pop() else "missed"


@dataclass(frozen=True)
class Level:
    """A value of the variable, or several values that are taken together.

    Attributes:
        low: The value; of several the smallest; NaN where no number varies.
        high: The value; of several the largest.
        points: Numbers of the points.
        n: Games of each point that count.
        mean: Mean of the quantity.
        mean_low: Lower end of its interval.
        mean_high: Upper end.
        state: "reached", "missed", or "open" where the interval holds the bound.
    """

    low: float
    high: float
    points: tuple[int, ...]
    n: int
    mean: float
    mean_low: float
    mean_high: float
    state: str

    @property
    def text(self) -> str:
        """The value, or the first and last of several: "12", "4 to 7.5"."""
        return written(self.low) if self.low == self.high else f"{written(self.low)} to {written(self.high)}"


@dataclass(frozen=True)
class Crossing:
    """Estimate of where the quantity first reaches the target, from a smooth fit to all values; it proves nothing.

    Attributes:
        value: Of the variable, by the fit; NaN where it stays below.
        low: By the better end of the fit's 95 % band.
        high: By its worse end; NaN where that does not reach the target.
    """

    value: float
    low: float
    high: float

    @property
    def text(self) -> str:
        """The value with its interval, to the digits that the interval allows: "13.4 (12.9 to 14.1)"."""
        if not self.high > self.low:
            return f"{self.value:.3g} ({self.low:.3g} or more)"
        digits = max(-math.floor(math.log10(self.high - self.low)), 0)
        value, low, high = (decimals(number, digits) for number in (self.value, self.low, self.high))
        return f"{value} ({low} to {high})"


def crossing_of(response: Response, target: Target, over: str, choice: Mapping[str, Any]) -> Crossing | None:
    """Return where a fit first reaches a target; None if it does not.

    Args:
        response: The fit.
        target: The target.
        over: Name of the variable.
        choice: Values of the others that are held.
    """
    names = [axis.variable.name for axis in response.axes]
    if over not in names:
        return None
    values = response.axis(over).values
    space = np.geomspace if response.axis(over).is_log else np.linspace
    x = space(float(values[0]), float(values[-1]), N_FITTED)
    given = {name: value for name, value in choice.items() if name in names}
    fit = response.along(over, x.tolist(), given)
    ends = (fit.high, fit.low) if target.is_lower else (fit.low, fit.high)
    value, low, high = (_first(x, y if target.is_lower else -y, target) for y in (fit.value, *ends))
    return Crossing(value, low, high) if math.isfinite(value) else None


def _first(x: np.ndarray, y: np.ndarray, target: Target) -> float:
    """The smallest x from which on values y, of which more is better, reach the bound, between two of them by a straight line."""
    above = y - (target.bound if target.is_lower else -target.bound)
    places = np.flatnonzero(above >= 0.0)
    if not len(places):
        return math.nan
    i = int(places[0])
    if i == 0:
        return float(x[0])
    return float(x[i - 1] + (x[i] - x[i - 1]) * above[i - 1] / (above[i - 1] - above[i]))


@dataclass(frozen=True)
class ChoiceAnswer:
    """The answer for one choice, that is one value of each variable that is no number.

    Attributes:
        values: The choice: name -> value; empty where there is none.
        levels: Values of the variable, ascending.
        crossing: Where a smooth fit reaches the target; None where it does not, or there is none.
    """

    values: dict[str, Any]
    levels: tuple[Level, ...]
    crossing: Crossing | None = None

    @property
    def label(self) -> str:
        """The choice: "tactic=lanes"; "" for none."""
        return ", ".join(f"{name}={written(value)}" for name, value in self.values.items())

    @property
    def smallest(self) -> Level | None:
        """The smallest value that reaches the target for sure; None for none."""
        return next((level for level in self.levels if level.state == "reached"), None)

    @property
    def at_least(self) -> Level | None:
        """The smallest value that may reach it; None where all miss it for sure."""
        return next((level for level in self.levels if level.state != "missed"), None)

    @property
    def is_decided(self) -> bool:
        """It is known which of the values is the smallest that reaches the target, or that none does."""
        return self.at_least is self.smallest

    @property
    def missed_above(self) -> Level | None:
        """The first value above `smallest` that misses the target again; None for none."""
        above = itertools.dropwhile(lambda level: level is not self.smallest, self.levels)
        return next((level for level in above if level.state == "missed"), None)

    @property
    def gap(self) -> tuple[float, float] | None:
        """The largest value below `smallest`, which misses, and `smallest`; None where the answer is open or is the first value."""
        place = self.levels.index(self.smallest) if self.smallest is not None else 0
        return (self.levels[place - 1].high, self.levels[place].low) if place and self.is_decided else None

    def wanted(self, target: Target, most: float = math.inf) -> list[Level]:
        """The open values with less than `most` games of which more would narrow the answer.

        That is from the smallest that may reach the target to the smallest that is known or seems to reach it; if `most` games did not
        tell of that one, to the next.
        """
        if self.is_decided:
            return []
        found = []
        for level in self.levels:
            if level.state == "reached":
                break
            if level.state == "open" and level.n < most:
                found.append(level)
                if target.is_reached(level.mean):
                    break
        return found


@dataclass(frozen=True)
class Answers:
    """The answers to the question of a target.

    Attributes:
        target: The target.
        title: The quantity with the teams by name.
        over: The variable whose smallest value is searched; None where no number varies.
        answers: One for each choice, in the order of the points.
        notes: What the reader must know, one line each.
    """

    target: Target
    title: str
    over: Variable | None
    answers: tuple[ChoiceAnswer, ...]
    notes: list[str] = field(default_factory=list)

    @property
    def is_decided(self) -> bool:
        """All answers are decided."""
        return all(answer.is_decided for answer in self.answers)

    def wanted(self, most: float = math.inf) -> list[int]:
        """The points with less than `most` games of which more would narrow an answer."""
        levels = (level for answer in self.answers for level in answer.wanted(self.target, most))
        return sorted({point for level in levels for point in level.points})

    def sentences(self) -> list[str]:
        """One sentence for each choice."""
        return [self._sentence(answer) + self._fitted(answer) for answer in self.answers]

    def _fitted(self, answer: ChoiceAnswer) -> str:
        return "" if answer.crossing is None else f"; by a smooth fit it takes {answer.crossing.text}"

    def _sentence(self, answer: ChoiceAnswer) -> str:
        whose = f"{answer.label}: " if answer.label else ""
        smallest, first = answer.smallest, answer.at_least
        if self.over is None:
            (level,) = answer.levels
            words = {"reached": "reaches", "missed": "misses", "open": "may reach"}[level.state]
            return f"{whose}{words} {self.target}: {estimate_text(level)}"
        unit = f" {self.over.unit}" if isinstance(self.over, Range) and self.over.unit else ""
        name = f"{self.over.name} = "
        if first is None:
            span = f"{answer.levels[0].text} to {answer.levels[-1].text}"
            best = max(answer.levels, key=lambda level: level.mean if self.target.is_lower else -level.mean)
            found = f"{whose}no value of {self.over.name} from {span}{unit} reaches {self.target}"
            return f"{found}; nearest is {best.text}{unit}: {estimate_text(best)}"
        if smallest is None:
            found = f"{whose}open: no value is sure to reach {self.target} yet"
            return f"{found}; the smallest that may is {name}{first.text}{unit}: {estimate_text(first)}"
        found = f"{whose}{name}{smallest.text}{unit} reaches {self.target}: {estimate_text(smallest)}"
        if first is not smallest:
            found += f"; the smallest that does is from {first.text} to {smallest.text}{unit}"
        elif smallest is answer.levels[0]:
            found += "; it is the smallest that was played"
        else:
            found += f"; {answer.levels[answer.levels.index(smallest) - 1].text}{unit} does not"
        return found + (f"; {again.text}{unit} misses it again" if (again := answer.missed_above) else "")

    def as_dict(self) -> dict[str, Any]:
        """The same for JSON."""
        return {
            "target": str(self.target),
            "over": self.over.name if self.over else None,
            "answers": [
                {
                    "choice": answer.values,
                    "is_decided": answer.is_decided,
                    "smallest": _of(answer.smallest),
                    "at_least": _of(answer.at_least),
                    "fitted": None if (c := answer.crossing) is None else [*map(_plain, (c.value, c.low, c.high))],
                    "levels": [
                        {
                            "from": _plain(level.low), "to": _plain(level.high), "n": level.n, "state": level.state,
                            "mean": _plain(level.mean), "low": _plain(level.mean_low), "high": _plain(level.mean_high),
                        }
                        for level in answer.levels
                    ],
                }
                for answer in self.answers
            ],
            "sentences": self.sentences(),
            "notes": self.notes,
        }  # fmt: skip


def _of(level: Level | None) -> float | None:
    return None if level is None else _plain(level.low)


def _plain(number: float) -> float | None:
    return number if math.isfinite(number) else None


def estimate_text(level: Level) -> str:
    """The mean with its interval: "0.962 (0.951 to 0.974)"."""
    if not math.isfinite(level.mean):
        return "no game has it"
    if not math.isfinite(level.mean_low):
        return f"{level.mean:.3g}, too few games for an interval"
    width = level.mean_high - level.mean_low
    digits = min(max(2 - math.floor(math.log10(width)), 0), 6) if width > 0.0 else 3
    return f"{level.mean:.{digits}f} ({level.mean_low:z.{digits}f} to {level.mean_high:z.{digits}f})"


# -- the levels -----------------------------------------------------------------------------------------------------------


def is_ordered(variable: Variable) -> bool:
    """Return True if the values of a variable are numbers."""
    return isinstance(variable, Range) or all(
        isinstance(v, (int, float)) and not isinstance(v, bool) for v in variable.values
    )


def variable_over(variables: Sequence[Variable], name: str | None) -> Variable | None:
    """The variable whose smallest value is searched: the named one, else the first range, else the first choice of numbers.

    Raises:
        ParameterError: There is no such variable, or its values are no numbers.
    """
    known = [v.name for v in variables]
    if name is not None:
        if name not in known:
            raise ParameterError(
                f"over {name!r}: it was not varied{nearest_name(name, known)}; {listed(known)}"
            )
        chosen = variables[known.index(name)]
        if not is_ordered(chosen):
            raise ParameterError(f"over {name!r}: its values are no numbers, so there is no smallest one")
        return chosen
    ordered = [v for v in variables if is_ordered(v)]
    return next((v for v in ordered if isinstance(v, Range)), ordered[0] if ordered else None)


@dataclass(frozen=True)
class Layout:
    """How the points of a batch make up choices and levels.

    Attributes:
        over: The variable whose smallest value is searched; None where no number varies.
        choices: Values of each choice.
        levels: Of each choice the points of each level, by ascending value.
        notes: What the reader must know, one line each.
    """

    over: Variable | None
    choices: tuple[dict[str, Any], ...]
    levels: tuple[tuple[tuple[int, ...], ...], ...]
    notes: tuple[str, ...] = ()

    @staticmethod
    def of(
        variables: Sequence[Variable], points: Sequence[Mapping[str, Any]], over: str | None = None
    ) -> Layout:
        """The layout of some points.

        Raises:
            ParameterError: There is no such variable, or its values are no numbers.
        """
        chosen = variable_over(variables, over)
        others = [v for v in variables if v is not chosen]
        named = [v.name for v in others if isinstance(v, Choice)]
        drawn = [v.name for v in others if isinstance(v, Range)]
        by_choice: dict[tuple[Any, ...], list[int]] = {}
        for i, point in enumerate(points):
            by_choice.setdefault(tuple(point[name] for name in named), []).append(i)
        choices = tuple(dict(zip(named, key, strict=True)) for key in by_choice)
        if chosen is None:
            return Layout(None, choices, tuple((tuple(numbers),) for numbers in by_choice.values()))
        levels, is_binned = [], False
        for numbers in by_choice.values():
            x = [float(points[i][chosen.name]) for i in numbers]
            found, is_own = _levels_of(x, [tuple(points[i][name] for name in drawn) for i in numbers])
            is_binned = is_binned or not is_own
            levels.append(tuple(tuple(numbers[i] for i in level) for level in found))
        notes = []
        if drawn:
            notes.append(
                f"means are over the values of {', '.join(drawn)} that were played; --over names another variable"
            )
        if is_binned:
            notes.append(
                f"neighbouring values of {chosen.name} are taken together, since they were drawn with those of {', '.join(drawn)}"
            )
        return Layout(chosen, choices, tuple(levels), tuple(notes))


def _levels_of(values: Sequence[float], others: Sequence[tuple[Any, ...]]) -> tuple[list[list[int]], bool]:
    """Places of equal values, ascending; or of neighbouring ones, where the other variables have other values at each."""
    x = np.array(values)
    distinct, index = np.unique(x, return_inverse=True)
    levels = [np.flatnonzero(index == i).tolist() for i in range(len(distinct))]
    if len({tuple(sorted(others[i] for i in level)) for level in levels}) == 1:
        return levels, True
    n_parts = int(np.clip(len(x) // MIN_IN_PART, 1, MAX_PARTS))
    parts = np.array_split(np.arange(len(distinct)), min(n_parts, len(distinct)))
    return [[i for level in part.tolist() for i in levels[level]] for part in parts], False


def answers_of(
    target: Target, title: str, layout: Layout, points: Sequence[Mapping[str, Any]], matrix: np.ndarray
) -> Answers:
    """The answers that the games so far give.

    The intervals of all levels of a choice hold together, at any number of games, with 95 %: each is a confidence sequence at its
    part of the error probability (Bonferroni). So does the answer that is read off them, whatever the shape of the curve.

    Args:
        target: The target.
        title: The quantity with the teams by name.
        layout: Choices and levels.
        points: Values of each point.
        matrix: The quantity by seed and point, (n_seeds, n_points); NaN where a game failed or is not played.
    """
    seen = seen_in(matrix, target.quantity.may_be_negative)
    found = []
    for values, levels in zip(layout.choices, layout.levels, strict=True):
        alpha = (1.0 - LEVEL) / len(levels)
        of_choice = []
        for numbers in levels:
            games = matrix[:, list(numbers)]
            observed = games[np.isfinite(games).all(axis=1)].mean(
                axis=1
            )  # of each seed one, which all points share
            low, high = sequential_interval(observed, alpha, seen)
            mean = float(observed.mean()) if len(observed) else math.nan
            x = (
                [float(points[i][layout.over.name]) for i in numbers]
                if layout.over is not None
                else [math.nan]
            )
            of_choice.append(
                Level(min(x), max(x), numbers, len(observed), mean, low, high, target.state(low, high))
            )
        found.append(ChoiceAnswer(values, tuple(of_choice)))
    return Answers(target, title, layout.over, tuple(found), list(layout.notes))
