"""The sections of a report, from top to bottom, as sentences, plots and tables."""

from __future__ import annotations

import itertools
import math
import shlex
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from tussle.batch.default_quantities import is_of_network, varies
from tussle.batch.quantities import metric_of
from tussle.batch.report import plots
from tussle.batch.report.formatting import (
    capital,
    count,
    estimate,
    file_name,
    interval,
    number,
    percent,
    seconds,
    sentence,
)
from tussle.batch.report.report_data import Measure, ReportData
from tussle.batch.selection import written
from tussle.batch.variables import Range
from tussle.folders import real_path
from tussle.palette import PAPER, mixed
from tussle.record.event_texts import END_TEXTS, end_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MAX_MEANS = 60
MAX_SAID = 3
"""Number of measured quantities in the sentence on the result."""
MAX_FAILED = 50
MAX_SLOW = 10
SMALL = 5
"""Teams with fewer entities than the largest by this factor have their own plot."""
MAX_CURVES = 6
"""Largest number of points with a curve each in one plot."""
METHODS = {
    "lhs": "a Latin hypercube",
    "sobol": "a scrambled Sobol sequence",
    "saltelli": "Saltelli's rows for variance-based indices",
    "grid": "all combinations of the values",
    "list": "values taken together, one after another",
    "product": "all choices at each point of a Latin hypercube of the ranges",
}


@dataclass(frozen=True)
class Plot:
    """A plot with its text.

    Args:
        name: Of its files, without an ending.
        title: What it shows.
        caption: How to read it.
        draw: Makes the figure.
    """

    name: str
    title: str
    caption: str
    draw: Callable[[], Figure]


@dataclass(frozen=True)
class ReportTable:
    """A table with its text.

    Args:
        title: What it shows; empty if the title of the section says it.
        columns: Name and kind of each column: "text", "number" (aligned right), "code" or "link".
        rows: Cells as they are shown, row by row; of a link, its text and its address.
        caption: How to read it.
    """

    title: str
    columns: Sequence[tuple[str, str]]
    rows: Sequence[Sequence[str | tuple[str, str]]]
    caption: str = ""


@dataclass(frozen=True)
class Section:
    """A part of the page under one heading.

    Args:
        name: Its identifier.
        title: Its heading.
        lead: Sentences under the heading, one paragraph each.
        plots: Its plots.
        tables: Its tables.
        facts: Names and values, as a list.
    """

    name: str
    title: str
    lead: Sequence[str] = ()
    plots: Sequence[Plot] = ()
    tables: Sequence[ReportTable] = ()
    facts: Sequence[tuple[str, str]] = ()

    @property
    def is_empty(self) -> bool:
        return not (self.lead or self.plots or self.tables or self.facts)


def numbers(*names: str) -> list[tuple[str, str]]:
    """Columns of numbers."""
    return [(name, "number") for name in names]


# -- who won ----------------------------------------------------------------------------------------------------------------


def won(data: ReportData) -> Section:
    """The section on wins and margins."""
    if not data.wins:
        return Section("won", "Who won")
    shares = [s for s in data.results.shares() if s.team is None or s.team in data.rivals]
    shares.sort(key=lambda s: (s.team is None, -s.n, s.team or 0))
    colours = [plots.END_COLOURS["time"] if s.team is None else data.results.colours[s.team] for s in shares]
    blocks = ""
    if data.has_points:
        is_shared = not data.results.info.get("independent")
        blocks = f", over all points; {'games of one seed count as one block' if is_shared else 'each game counts by itself'}"
    caption = (
        f"Bar: share of the {count(data.n_good, 'game')}. Line: its 95 % interval (Wilson){blocks}. A tie is a game with two highest"
        " scores."
    )
    found = [Plot("wins", "Games won", caption, lambda: plots.share_bars(shares, colours))]
    if len(data.wins) >= 2 and not data.has_points:
        first, second = data.rivals[:2]
        label = f"score of {data.name_of(first)} minus score of {data.name_of(second)}"
        lead = Measure(f"score[{first}]-score[{second}]", "", None, label)
        found.append(_distribution(data, [lead], "margin"))
    return Section("won", "Who won", plots=found)


def _outside(values: np.ndarray) -> str:
    """Return the sentence of the caption on values outside the plot; "" if there are none."""
    n = len(values) - len(plots.inside(values))
    far = f"from {number(values.min())} to {number(values.max())}"
    return f" The values go {far}; {count(n)} of {count(len(values))} lie beyond the plot." if n else ""


# -- scores -----------------------------------------------------------------------------------------------------------------


def scores(data: ReportData) -> Section:
    """The section on the means of all quantities, and their distributions at each of a few points."""
    found = []
    if len(data.points) <= MAX_CURVES:
        for measures in (data.scores, *((measure,) for measure in data.measured)):
            varied = [m for m in measures if varies(data.known(m.expression))]
            if varied and not data.has_points:
                found.append(_distribution(data, varied))
            elif data.has_points:
                found += [_distribution_by_point(data, m) for m in varied]
    means = _means(data)
    title = "How much was scored" if data.rivals else "Quantities"
    return Section("scores", title, plots=found, tables=[means] if means.rows else [])


def _distribution_by_point(data: ReportData, measure: Measure) -> Plot:
    values = data.results.quantity(measure.expression)
    rows = [values[(data.point == i) & np.isfinite(values)] for i in range(len(data.points))]
    names = [data.point_name(i) for i in range(len(rows)) if len(rows[i])]
    rows = [row for row in rows if len(row)]
    title = data.title(measure.expression)
    return Plot(
        f"distribution-{file_name(measure.expression)}",
        f"{capital(title)} at each point",
        "Height: number of games, on one scale. Dot: mean. Line: the middle half of the games."
        + _outside(np.concatenate(rows)),
        lambda: plots.distributions(rows, names, [measure.colour] * len(rows), title),
    )


def _distribution(data: ReportData, measures: Sequence[Measure], name: str = "") -> Plot:
    has_teams, label = measures[0].team is not None, measures[0].label
    values = [data.known(m.expression) for m in measures]
    names, colours = [m.name if has_teams else "" for m in measures], [m.colour for m in measures]
    return Plot(
        name or ("scores" if has_teams else f"distribution-{file_name(measures[0].expression)}"),
        "Distribution of the scores" if has_teams and data.rivals else capital(label),
        "Height: number of games, on one scale. Dot: mean. Line: the middle half of the games."
        + _outside(np.concatenate(values)),
        lambda: plots.distributions(values, names, colours, label),
    )


def _means(data: ReportData) -> ReportTable:
    """Means of all quantities that vary."""
    results = data.results

    names = [q for q in results.quantities if metric_of(q) not in ("wins", "ties", "start", "alive", "steps")]
    is_count = is_of_network(results.quantities)  # these have their own section
    asked = [m.expression for m in data.more]
    names = results.telling([*asked, *(name for name in names if not is_count(name))])
    rows = [_mean_cells(data, name) for name in names[:MAX_MEANS]]
    interval_, quantiles = ("lowest point", "highest point"), ("5 %", "median", "95 %")
    columns = [
        ("quantity", "text"),
        *numbers("mean", "95 % interval", "sd", *(interval_ if data.has_points else quantiles), "games"),
    ]
    caption = "The interval is that of the mean. "
    caption += (
        "sd: standard deviation of the games of a point. Lowest and highest point: the extreme means of points."
        if data.has_points
        else "5 %, median and 95 % are quantiles of the games."
    )
    caption += " What is constant, a varied value or another quantity again is left out."
    if len(names) > MAX_MEANS:
        caption += f" {len(names) - MAX_MEANS} more quantities are in the tables of the batch."
    return ReportTable("All quantities", columns, rows, caption)


def _mean_cells(data: ReportData, name: str) -> tuple[str, ...]:
    mean = data.results.means([name])[0]
    head = (data.title(name), estimate(mean.value), interval(mean.low, mean.high))
    if not data.has_points:
        quantiles = (number(mean.quantiles[q]) for q in (0.05, 0.5, 0.95))
        return (*head, estimate(mean.sd), *quantiles, count(mean.n))
    points = data.results.means_by_point(name)
    known = [point.value for point in points if point.n]
    spread = [point.sd**2 for point in points if point.n > 1]
    sd = math.sqrt(float(np.mean(spread))) if spread else math.nan
    return (*head, estimate(sd), estimate(min(known)), estimate(max(known)), count(mean.n))


# -- the games --------------------------------------------------------------------------------------------------------------


def left(data: ReportData) -> Section:
    """The section on the number of survivors of each team over time."""
    losses = {t: data.known(f"lost[{t}]") for t in data.results.teams}
    teams = [t for t, lost in losses.items() if np.any(lost > 0.0)]
    if not teams:
        return Section("left", "Who was left")
    size = {team: float(data.known(f"start[{team}]").max(initial=0.0)) for team in teams}
    large = [team for team in teams if size[team] * SMALL >= max(size.values())]
    found = [_left(data, some) for some in (large, [t for t in teams if t not in large]) if some]
    if 1 < len(data.points) <= MAX_CURVES:
        found += [_left_by_point(data, team) for team in teams]
    return Section("left", "Who was left", plots=found)


def _left(data: ReportData, teams: Sequence[int]) -> Plot:
    names = ", ".join(map(data.name_of, teams)) if len(teams) <= 4 else f"{len(teams)} teams"
    band = "" if len(data.points) > 1 else " Band: 95 % interval of the mean at each time."
    return Plot(
        f"left-{'-'.join(map(str, teams))}",
        f"{names} left over time",
        f"Mean number of each team that is left.{band} Games that ended keep their last number.",
        lambda: plots.over_time(
            [_curve(data, t, None, data.name_of(t), data.results.colours[t], "-") for t in teams],
            f"{names} left" if len(teams) == 1 else "number left",
        ),
    )


def _left_by_point(data: ReportData, team: int) -> Plot:
    n, name = len(data.points), data.name_of(team)
    dashes = ["-", "--", "-.", ":", (0, (5, 1)), (0, (1, 1))]
    ramp = [mixed(data.results.colours[team], PAPER, 0.45 * (1.0 - i / (n - 1))) for i in range(n)]
    return Plot(
        f"left-{team}-by-point",
        f"{name} left, by {data.results.variables[0].name if len(data.results.variables) == 1 else 'point'}",
        "Mean number left at each point. Band: 95 % interval of the mean at each time.",
        lambda: plots.over_time(
            [_curve(data, team, i, data.point_name(i), ramp[i], dashes[i]) for i in range(n)], f"{name} left"
        ),
    )


def _curve(
    data: ReportData, team: int, point: int | None, name: str, colour: str, dashes: Any
) -> plots.Series:
    s = data.results.survival(team, point)
    return plots.Series(name, colour, dashes, s.mean, s.low, s.high, s.t)


def networks(data: ReportData) -> Section:
    """The section on messages of lossy networks."""
    means = {
        m.name: m.value
        for m in data.results.means(
            list(filter(is_of_network(data.results.quantities), data.results.quantities))
        )
    }
    names = list(dict.fromkeys(name.rpartition(".")[0] for name in means))
    reasons = dict.fromkeys(
        name.rpartition(".lost_")[2] for name, value in means.items() if ".lost_" in name and value > 0.0
    )

    def row(network: str) -> list[str]:
        sent = means[f"{network}.sent"]
        parts = ["delivered", *(f"lost_{reason}" for reason in reasons)]
        shares = [means.get(f"{network}.{part}") for part in parts]
        return [
            network, estimate(sent), *("" if n is None or not sent else percent(n / sent) for n in shares),
        ]  # fmt: skip

    columns = [
        ("network", "text"),
        *numbers("messages", "delivered", *(f"lost: {r.replace('_', ' ')}" for r in reasons)),
    ]
    caption = "Mean number per game of messages to others within reach, each receiver counted, and what became of them."
    tables = [ReportTable("", columns, [row(name) for name in names], caption)] if names else []
    return Section("networks", "What became of the messages", tables=tables)


def ended(data: ReportData) -> Section:
    """When and why games ended."""
    runs, title = data.results.runs, "How the games ended"
    reason, t = np.array(runs["end"].to_pylist()), np.asarray(runs["t"].to_numpy())
    known = [end for end in dict.fromkeys([*END_TEXTS, *sorted({*reason})]) if end != "error"]
    ends = {str(end): t[reason == end] for end in known if np.any(reason == end)}
    if not ends:
        return Section("ended", title)
    every = np.concatenate(list(ends.values()))
    why = "; ".join(f"{end_text(end)}: {count(len(times), 'game')}" for end, times in ends.items())
    if not varies(every):
        return Section("ended", title, lead=[f"Length of every game: {number(every[0])} s. {capital(why)}."])
    caption = f"Height: number of games. Mean {estimate(every.mean())} s, median {number(float(np.median(every)))} s. {capital(why)}."
    return Section(
        "ended", title, plots=[Plot("lengths", "Length of the games", caption, lambda: plots.lengths(ends))]
    )


def notable_runs(data: ReportData) -> Section:
    """Section with failed games and those that took longest, and the commands that play them again."""
    results = data.results
    is_file = (results.info.get("mission") or {}).get("made_in") != "python"
    folder = real_path(results.path).name if results.path is not None and is_file else None

    def table(
        title: str,
        rows: Sequence[dict[str, Any]],
        columns: Sequence[tuple[str, str]],
        cells: Any,
        caption: str,
    ) -> ReportTable:
        values = [("values", "text")] if data.has_points else []
        replay = [("play it again", "code")] if folder is not None else []
        body = [
            (
                str(row["run"]), str(row["seed"]), *([results.label(row["point"])] if values else []), *cells(row),
                *([f"tussle run --from {shlex.quote(str(folder) + ':' + str(row['run']))}"] if replay else []),
            )
            for row in rows
        ]  # fmt: skip
        return ReportTable(title, [*numbers("run", "seed"), *values, *columns, *replay], body, caption)

    tables = []
    if n := results.n_failed:
        more = f" {count(n - MAX_FAILED)} more are in the tables of the batch." if n > MAX_FAILED else ""
        rows = results.failed().slice(0, MAX_FAILED).to_pylist()
        tables.append(
            table(
                f"{count(n, 'game')} failed", rows, [("error", "text")], lambda row: [row["error"] or ""],
                f"Failed games are in no share, mean or plot.{more}",
            )
        )  # fmt: skip
    if rows := results.slowest(MAX_SLOW).to_pylist():
        tables.append(
            table(
                "Slowest games", rows, numbers("CPU time", "length [s]"), lambda row: [seconds(row["cpu_s"]), number(row["t"])],
                "CPU time of a game that was played in a stack is its part of the stack's.",
            )
        )  # fmt: skip
    lead = [
        "Enter the commands in the folder that holds the batch. Each checks that the game ends in the same state."
    ]
    return Section(
        "look-at", "Games to look at", lead=lead if folder is not None and tables else [], tables=tables
    )


# -- how it was made --------------------------------------------------------------------------------------------------------


def making(data: ReportData) -> Section:
    """The section on the settings of the batch."""
    results, info = data.results, data.results.info
    facts = [(name, text) for name, text in _facts(info) if text]
    rows = [(v.name, _values_of(v)) for v in results.variables]
    caption = f"{count(len(data.points), 'point')}: {METHODS[data.method]}"
    caption += f", drawn with seed {info.get('sample_seed', 0)}." if data.is_drawn else "."
    tables = (
        [ReportTable("What varied", [("name", "code"), ("values", "text")], rows, caption)] if rows else []
    )
    return Section("making", "How this was made", tables=tables, facts=facts)


def _facts(info: dict[str, Any]) -> Iterator[tuple[str, str]]:
    about, timings = info.get("mission") or {}, info.get("timings") or {}
    yield "command", shlex.join(str(part) for part in info.get("command") or ())
    yield "mission", str(about.get("file") or "made in Python")
    yield "settings", ", ".join(f"{name}={value}" for name, value in (about.get("settings") or {}).items())
    start, end, dt = (number(float(info[name])) for name in ("start", "end", "dt"))
    yield "game", f"steps of {dt} s, from {start} s to {end} s"
    n = int(info["n_runs" if info.get("independent") else "n_seeds"])
    seeds = f"{info['first_seed']} to {int(info['first_seed']) + n - 1}" if n > 1 else str(info["first_seed"])
    sharing = "one for each game" if info.get("independent") else "the same at each point"
    yield "seeds", seeds if int(info["n_points"]) == 1 else f"{seeds}, {sharing}"
    yield "played until", str(info.get("until") or "")
    yield "played", str(timings.get("began") or "").replace("T", " ").replace("+00:00", " UTC")
    took = [seconds(float(timings[key])) for key in ("wall_s", "cpu_s") if timings.get(key)]
    yield "took", " and ".join(took) + (" of CPU time" if len(took) == 2 else "")
    yield "versions", ", ".join(f"{name} {version}" for name, version in (info.get("versions") or {}).items())
    yield "fingerprint", str(info.get("fingerprint") or "")


def _values_of(variable: Any) -> str:
    if not isinstance(variable, Range):
        shown = [written(value) for value in itertools.islice(variable.values, 12)]
        more = len(variable.values) - len(shown)
        return ", ".join(shown) + (f" and {count(more)} more" if more > 0 else "")
    parts = [f"{variable.low:g} to {variable.high:g} {variable.unit}".rstrip()]
    parts += ["whole numbers"] if variable.is_int else []
    parts += ["evenly by the logarithm"] if variable.is_log else []
    parts += [f"{variable.levels} values"] if variable.levels else []
    return ", ".join(parts)


# -- the head ---------------------------------------------------------------------------------------------------------------


def answer(data: ReportData) -> str:
    """The result in one or two sentences."""
    results = data.results
    if not results.n_runs:
        return "No game is finished yet."
    if not data.n_good:
        return (
            f"All {count(results.n_runs, 'game')} failed." if results.n_runs > 1 else "The only game failed."
        )
    games = count(data.n_good, "game") + (
        f" over {count(len(data.points), 'point')}" if data.has_points else ""
    )
    if not data.wins:
        return f"{_on_average(data)} in {games}."
    shares = [s for s in results.shares() if s.n > 0]
    ties = sum(s.n for s in shares if s.team is None)
    winners = sorted((s for s in shares if s.team is not None), key=lambda s: -s.n)
    if not winners:
        return f"All {games} ended in ties." if data.n_good > 1 else "The only game ended in a tie."
    ends = [  # none where all games have one seed
        f"{100.0 * s.low:.1f} to {100.0 * s.high:.1f}" if math.isfinite(s.low) else "" for s in winners
    ]
    first = winners[0]
    known = f", 95 % interval {ends[0]}" if ends[0] else ""
    parts = [f"{first.name} won {count(first.n)} of {games} ({percent(first.value)}{known})"]
    parts += [
        f"{s.name} {count(s.n)} ({percent(s.value)}{e and f', {e}'})"
        for s, e in zip(winners[1:3], ends[1:], strict=False)
    ]
    parts += [f"other teams {count(sum(s.n for s in winners[3:]))}"] if winners[3:] else []
    parts += [count(ties, "tie")] if ties else []
    return ", ".join(parts) + "."


def _on_average(data: ReportData) -> str:
    """Return the means of the first quantities, for games that nobody wins."""
    found, results = [], data.results
    over = ", over these points" if data.has_points else ""
    for mean in results.means(results.defaults.leading[:MAX_SAID]):
        known = f" (95 % interval {interval(mean.low, mean.high)}{over})" if math.isfinite(mean.low) else ""
        team = mean.name.removeprefix("alive")
        if team != mean.name:
            start = results.means([f"start{team}"])[0].value
            found.append(
                f"{estimate(mean.value)} of {number(start)} {results.title(mean.name).partition(' of ')[2]} were left{known}"
            )
        else:
            found.append(f"{data.title(mean.name)} was {estimate(mean.value)}{known}")
    return f"On average, {' and '.join(found)}"


def notes(data: ReportData) -> list[str]:
    """Return notes on missing and failed games, for the top of the page."""
    results = data.results
    found = [sentence(note) for note in results.notes]
    if results.n_failed:
        found.append(
            f"{count(results.n_failed, 'game')} of {count(results.n_runs)} failed and {'is' if results.n_failed == 1 else 'are'} in no"
            " number; the section “Games to look at” lists the errors."
        )
    if stopped := results.info.get("stopped_by"):
        found.append(
            f"The batch ended by its rule: {stopped}. An interval that made the batch stop is no test."
        )
    return found
