"""The head of a report: short answers to what one asks first of a batch."""

from __future__ import annotations

import math
import shlex
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tussle.batch.further import further_runs
from tussle.batch.report.formatting import capital, count, estimate, number, p_value, percent
from tussle.batch.report.report_data import Measure, ReportData, strength_of
from tussle.batch.response import FittedVariable, Response
from tussle.batch.results import Results
from tussle.batch.selection import written
from tussle.batch.statistics import sign_test
from tussle.batch.target import Answers
from tussle.batch.variables import Range
from tussle.folders import real_path

MAX_ASKED = 2
"""Numbers and choices that are asked for by name, each."""
MAX_CAUSES = 4
N_ALONG = 41
MAX_OF_IT = 0.9
MAX_LINES_SAID = 3
"""A choice with at most so many values is told apart where most of a change is done."""
LITTLE, MUCH = 0.2, 0.6
"""Parts of the variance below which chance plays a small part, and above which it plays the largest."""


@dataclass(frozen=True)
class ShortAnswer:
    """A question, and its answer in one or two sentences.

    Attributes:
        question: What one asks.
        text: The answer.
        command: Plays the game again that the answer names; empty for none.
    """

    question: str
    text: str
    command: str = ""


def answers(data: ReportData) -> list[ShortAnswer]:
    """Which choice, how many, what matters, when it went wrong, and whether it is luck; as far as the batch can tell."""
    if not data.n_good or not data.measures:
        return []
    lead = data.measures[0]
    ranked = data.by_strength(lead) if data.axes else []
    choices = [axis for axis in ranked if not axis.is_number][:MAX_ASKED]
    amounts = [axis for axis in ranked if axis.is_number][:MAX_ASKED]
    found = [
        *(
            ShortAnswer(f"Which {_short(data, a)}?", text)
            for a in choices
            if (text := _best_value(data, lead, a))
        ),
        *(ShortAnswer(_how_many(data, a), text) for a in amounts if (text := _trend(data, lead, a))),
    ]
    extreme, command = _extreme_game(data, lead)
    found.append(ShortAnswer("What matters?", _important_variables(data, lead)))
    found.append(
        ShortAnswer("When did it go wrong?", f"{' '.join(_losses(data))} {extreme}".strip(), command)
    )
    found.append(ShortAnswer("Is it luck?", _luck(data, lead)))
    return [each for each in found if each.text]


def further(question: Answers, results: Results) -> list[ShortAnswer]:
    """Which runs would narrow the answer to the question of a target."""
    runs = further_runs(question, results.info, results.path)
    return [ShortAnswer("What would narrow it?", f"{capital(what)}:", command) for what, command in runs]


def _short(data: ReportData, axis: FittedVariable) -> str:
    """The last part of a variable's name, if no other variable ends so."""
    last = [v.name.rpartition(".")[2] for v in data.results.variables]
    mine = axis.variable.name.rpartition(".")[2]
    return mine if last.count(mine) == 1 else axis.variable.name


def _how_many(data: ReportData, axis: FittedVariable) -> str:
    """Ask for a number of entities by "how many", and for any other number by "which"."""
    variable, results = axis.variable, data.results
    values = np.array([float(point[variable.name]) for point in data.points])[data.point]
    is_count = isinstance(variable, Range) and variable.is_int
    for start in (name for name in results.quantities if name.startswith("start[")):
        is_count = is_count or np.array_equal(results.quantity(start), values)
    if variable.name.endswith(".count"):
        return f"How many {variable.name.removesuffix('.count')}?"
    return f"{'How many' if is_count else 'Which'} {_short(data, axis)}?"


def _subject(data: ReportData, lead: Measure) -> str:
    return f"The share of games won by {lead.name}" if lead.is_share else capital(data.title(lead.expression))


def _shown(lead: Measure, value: float) -> str:
    return percent(value) if lead.is_share else estimate(value)


def _known(value: float, low: float, high: float, scale: float = 1.0, unit: str = "") -> str:
    """An estimate with its interval, to the digits that the interval allows: "0.47 (0.38 to 0.56)"."""
    width = scale * (high - low)
    if not width > 0.0:
        return f"{estimate(scale * value)}{unit}"
    digits = min(max(1 - math.floor(math.log10(width)), 0), 9)
    shown = (f"{scale * v:z.{digits}f}".replace("-", "−") for v in (value, low, high))
    return "{}{} ({} to {})".format(next(shown), unit, *shown)


def _difference(lead: Measure, value: float, low: float, high: float) -> str:
    """A difference with its interval, and whether chance alone would make it."""
    scale, unit = (100.0, " percentage points") if lead.is_share else (1.0, "")
    if high < 0.0:
        value, low, high = -value, -high, -low
    chance = (
        "" if not math.isfinite(low) else ", more than chance makes" if low > 0.0 else ", which may be chance"
    )
    return f"a difference of {_known(value, low, high, scale, unit)}{chance}"


# -- which, and how many ----------------------------------------------------------------------------------------------------


def _best_value(data: ReportData, lead: Measure, axis: FittedVariable) -> str:
    """Sentence about the best and the second best value of a choice, and about where their order changes."""
    means = data.means_at(axis, lead)[:, 0]
    if not np.isfinite(means).all():
        return ""
    first, second = np.argsort(-means, kind="stable")[:2].tolist()
    a, b = axis.values[second], axis.values[first]
    name, response = axis.variable.name, data.response(lead)
    if response is not None:
        value, low, high = response.difference(name, a, b)
    else:
        try:
            found = data.results.compare(lead.expression, *(_side(data, name, v) for v in (a, b)))
        except ValueError:  # no two points differ in it alone
            return ""
        value, low, high = found.difference, found.low, found.high
    others = [other.variable.name.rpartition(".")[2] for other in data.axes if other != axis]
    same = f" at the same {' and '.join(others)}" if 0 < len(others) < 3 else ""
    than = "next best " if len(axis.values) > 2 else ""
    text = (
        f"{_subject(data, lead)} is {_shown(lead, means[first])} with {written(b)} and {_shown(lead, means[second])} with "
        f"{than}{written(a)}"
        f"{same}: {_difference(lead, value, low, high)}."
    )
    turns = _crossover(data, lead, response, axis, a, b) if response is not None else ""
    return f"{text} {turns}".strip()


def _side(data: ReportData, name: str, value: Any) -> int | str:
    points = data.points_with({name: value})
    return points[0] if len(points) == 1 else f"{name}={value}"


def _crossover(
    data: ReportData, lead: Measure, response: Response, axis: FittedVariable, a: Any, b: Any
) -> str:
    """Clause about the value of the strongest number at which two values of a choice change places; "" without one."""
    other = next((other for other in data.by_strength(lead) if other.is_number), None)
    if other is None:
        return ""
    ends = (other.values[0], other.values[-1])
    found = [response.difference(axis.variable.name, a, b, {other.variable.name: end}) for end in ends]
    signs = [int(low > 0.0) - int(high < 0.0) for _, low, high in found]
    if not any(signs) or signs[0] == signs[1]:
        return ""
    at = [f"{_short(data, other)} {number(float(f'{end:.3g}'))}" for end in ends]
    parts = [
        f"{written(b if sign > 0 else a)} has more at {place}"
        if sign
        else f"no difference is seen at {place}"
        for sign, place in zip(signs, at, strict=True)
    ]
    return f"{capital(', '.join(parts))}."


def _trend(data: ReportData, lead: Measure, axis: FittedVariable) -> str:
    """Sentence about the trend of a quantity over a number, with the range in which most of the change happens."""
    response, name = data.response(lead), axis.variable.name
    if response is None:
        return ""
    at = axis.spread(N_ALONG)
    fit = response.along(name, at)
    lowest, highest, last = int(np.argmin(fit.value)), int(np.argmax(fit.value)), len(at) - 1
    unit = f" {axis.unit}" if axis.unit else ""
    scale, sign = (100.0, " %") if lead.is_share else (1.0, "")

    def place(i: int) -> str:
        return f"{number(float(f'{at[i]:.4g}'))}{unit}"

    def value(i: int) -> str:
        return _known(fit.value[i], fit.low[i], fit.high[i], scale, sign)

    if not response.difference(name, at[lowest], at[highest])[1] > 0.0:
        return f"{_subject(data, lead)} does not visibly follow it: {value(0)} at {place(0)}, {value(last)} at {place(last)}."
    for first, far, verb in ((lowest, highest, "rises"), (highest, lowest, "falls")):
        beyond = response.difference(name, at[far], at[last])
        if first == 0 and (far == last or beyond[1] <= 0.0 <= beyond[2]):  # it may end flat
            return (
                f"{_subject(data, lead)} {verb} from {value(0)} at {place(0)} to {value(far)} at {place(far)}; nine tenths of that by "
                f"{_main_change(data, response, axis, at)}{unit}."
            )
    return f"{_subject(data, lead)} is highest at {place(highest)}, {value(highest)}, and lowest at {place(lowest)}, {value(lowest)}."


def _main_change(data: ReportData, response: Response, axis: FittedVariable, at: Sequence[Any]) -> str:
    """Value of the number at which 90 % of the change from the first place to the extreme is reached, for each value of a choice."""
    lines, texts = data.lines, []
    held: list[dict[str, Any]] = [{}]
    if lines is not None and len(lines.values) <= MAX_LINES_SAID:
        held = [{lines.variable.name: value} for value in lines.values]
    for given in held:
        value = response.along(axis.variable.name, at, given).value
        change = np.abs(value - value[0])
        place = number(float(f"{at[int(np.argmax(change >= MAX_OF_IT * change.max()))]:.4g}"))
        texts.append(" with ".join([place, *map(written, given.values())]))
    return " and ".join(texts)


# -- what matters, and chance -----------------------------------------------------------------------------------------------


def _important_variables(data: ReportData, lead: Measure) -> str:
    if not data.axes:
        differ = (
            "; games differ by their seeds alone"
            if data.results.n_distinct > 1
            else ", and the games are all alike"
        )
        return f"Nothing was varied{differ}." if data.n_good > 1 else ""
    effects = data.effects(lead)
    parts = [
        (e.variable, e.first_order, e.first_low, e.first_high) for e in effects if e.first_order is not None
    ]
    if parts:
        texts = []
        for name, part, low, high in sorted(parts, key=lambda p: -(p[1] or 0.0))[:MAX_CAUSES]:
            is_known = low is not None and high is not None
            ends = f" ({100.0 * max(low, 0.0):.0f} to {100.0 * min(high, 1.0):.0f})" if is_known else ""  # type: ignore[type-var,operator]
            who = {"seed": "the seed", "unexplained": "what none of them explains"}.get(name, name)
            texts.append(f"{who} {percent(max(part or 0.0, 0.0), 0)}{ends}")
        whole = "the games" if any(e.method in ("anova", "fit") for e in effects) else "the points"
        return f"Of the variance of {_low(data, lead)} between {whole}: {', '.join(texts)}."
    if any("does not vary" in e.note for e in effects):
        return f"Nothing that was varied: the mean of {_low(data, lead)} is the same at all points."
    ranks = sorted((e for e in effects if strength_of(e) is not None), key=lambda e: -(strength_of(e) or 0.0))
    if not ranks:
        return ""
    texts = [f"{e.variable} {estimate(e.rank_correlation)}" for e in ranks[:MAX_CAUSES]]
    return f"Rank correlation with {_low(data, lead)}: {', '.join(texts)}; for parts of the variance there are too few points."


def _low(data: ReportData, lead: Measure) -> str:
    what = _subject(data, lead)
    return what[:1].lower() + what[1:] if lead.is_share else data.title(lead.expression)


def _luck(data: ReportData, lead: Measure) -> str:
    """How far games of one point differ, and how well a point's mean is known."""
    results = data.results
    means = results.means_by_point(lead.expression)
    n = min(mean.n for mean in means)
    if n < 2:
        return "That cannot be told: not every point was played twice. More seeds (--runs) tell."
    if results.n_distinct == len(results.points):
        return f"No: the games{' of a point' if data.has_points else ''} are all alike; their seeds change nothing."
    halves = [(mean.high - mean.low) / 2.0 for mean in means if math.isfinite(mean.low)]  # not of copies
    known = f"±{_width(lead, float(np.median(halves)))} with {count(n, 'seed')}"
    if not data.has_points:
        return _luck_of_seeds(data, lead, known)
    spread = math.sqrt(float(np.mean([mean.sd**2 for mean in means])))
    part = next((e.first_order for e in data.effects(lead) if e.variable == "seed"), None)
    prefix = ""
    if part is not None:
        word = "little" if part < LITTLE else "mostly" if part > MUCH else "partly"
        prefix = f"In one game, {word}: the seed makes {percent(part, 0)} of the variance. "
    one = f"a game differs from the mean of its point by {_width(lead, spread)} (standard deviation)"
    return f"{prefix}{capital(one)}; the mean of a point is known to {known}."


def _luck_of_seeds(data: ReportData, lead: Measure, known: str) -> str:
    if len(data.wins) > 1:
        wins = {share.team: share.n for share in data.results.shares()}
        first, second = (measure.team for measure in data.wins[:2])
        p = sign_test(wins[first], wins[second])
        names = [measure.name for measure in data.wins[:2]]
        verdict = "Hardly" if p < 0.05 else "It may be"
        return (
            f"{verdict}: were {names[0]} and {names[1]} equally good, {count(wins[first])} wins to {count(wins[second])} or less even ones "
            f"would have a probability of {p_value(p)}."
        )
    mean = data.results.means([lead.expression])[0]
    return (
        f"All of the difference between games is: a game differs from the mean by {_width(lead, mean.sd)} (standard deviation). "
        f"The mean is known to {known}."
    )


def _width(lead: Measure, value: float) -> str:
    return f"{estimate(100.0 * value)} percentage points" if lead.is_share else estimate(value)


# -- when it went wrong -----------------------------------------------------------------------------------------------------


def _losses(data: ReportData) -> Iterator[str]:
    """Yield sentences about the times of losses and about failed games."""
    results = data.results
    lost = [(team, mean) for team in results.diminished for mean in results.means([f"lost[{team}]"])]
    for team, mean in sorted(lost, key=lambda pair: -pair[1].value)[:2]:
        half = _half_lost(results, team)
        when = f", half of them by {number(half)} s" if math.isfinite(half) else ""
        yield f"{capital(data.name_of(team))} lost {estimate(mean.value)} a game{when}."
    if not lost:
        yield "Nobody was lost."
    if results.n_failed:
        failed = results.failed()
        yield f"{count(results.n_failed, 'game')} failed, the first is run {failed['run'][0].as_py()}."


def _half_lost(results: Results, team: int) -> float:
    """Time by which half of what a team lost in all games was lost [s]; NaN where births in the same steps hide losses."""
    lost = results.quantity(f"lost[{team}]")
    run, t, of_team, left = (results.alive[name].to_numpy() for name in ("run", "t", "team", "alive"))
    rows = np.flatnonzero((of_team == team) & np.isin(run, results.runs["run"].to_numpy()[np.isfinite(lost)]))
    rows = rows[np.lexsort((t[rows], run[rows]))]
    falls = np.where(run[rows][1:] == run[rows][:-1], left[rows][:-1] - left[rows][1:], 0).clip(0)
    if falls.sum() != np.nansum(lost):
        return math.nan
    order = np.argsort(t[rows][1:], kind="stable")
    so_far = np.cumsum(falls[order])
    return float(t[rows][1:][order][np.searchsorted(so_far, so_far[-1] / 2.0)])


def _extreme_game(data: ReportData, lead: Measure) -> tuple[str, str]:
    """The game with least of a quantity, and the command that plays it again."""
    results = data.results
    values = results.quantity(lead.expression)
    least = int(np.nanargmin(values))
    if lead.is_share or values[least] == np.nanmax(values):  # won or not: no game is the extreme one
        return "", ""
    run, seed, point = (results.runs[name][least].as_py() for name in ("run", "seed", "point"))
    where = f", {results.label(point)}" if data.has_points else ""
    text = f"The least {data.title(lead.expression)}, {number(values[least])}, is that of run {run} (seed {seed}{where})."
    if results.path is None or (results.info.get("mission") or {}).get("made_in") == "python":
        return text, ""
    return text, f"tussle run --from {shlex.quote(f'{real_path(results.path).name}:{run}')}"
