"""The page of a league: the table, each pairing, and replays of the games that decided them."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import TYPE_CHECKING

import pyarrow.compute as pc

import tussle
from tussle.batch import store
from tussle.batch.report import write_page
from tussle.batch.report.drawing import blank, house_style, pictured, rule_x
from tussle.batch.report.formatting import count, number, percent
from tussle.batch.report.sections import Plot, ReportTable, Section, numbers
from tussle.batch.results import Results
from tussle.errors import BatchError, RecordError
from tussle.folders import real_path
from tussle.palette import INK, TEAM_COLOURS
from tussle.record import Recorder, load_run
from tussle.rl.league import League, Pairing, Standings
from tussle.view.export.html import write_html
from tussle.view.recording import Recording

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PAGE = "league.html"
MAX_CROSSED = 12
"""Players up to whom the page has a table of each against each."""


def record_game(league: League, results: Results, pairing: Pairing, directory: Path) -> Path:
    """Play the deciding game of a pairing again, record it, and write its page. What is there already is kept.

    Returns:
        The page; the run directory lies beside it.

    Raises:
        BatchError: It ended otherwise than in the league.
        RecordError: The directory cannot be written.
    """
    run = directory / store.RUNS / f"{pairing.decider:06d}"
    page = run.with_suffix(".html")
    try:
        is_there = load_run(run).is_complete
    except RecordError:  # there is no run, or a damaged one
        is_there = False
    if not is_there:
        shutil.rmtree(run, ignore_errors=True)
        with league.batch.simulation(pairing.decider) as simulation:
            with Recorder(simulation, run):
                simulation.run()
            played = simulation.state_hash()
        wanted = results.runs.filter(pc.equal(results.runs["run"], pairing.decider))["state_hash"][0].as_py()
        if played != wanted:
            shutil.rmtree(run)
            raise BatchError(
                f"{directory}: run {pairing.decider} ends otherwise than in the league: that was on another machine, or a policy was "
                "rewritten while it was played; play the league in another directory"
            )
    if not page.exists() or not is_there:
        (others,) = (task.learners for _, task in league.sides if task.learners != pairing.sides)
        title = f"{pairing.a} ({pairing.sides}) against {pairing.b} ({others})"
        write_html(Recording(run), page, title=title)
    return page


def write_league_page(
    league: League, standings: Standings, directory: Path, replays: dict[int, Path]
) -> Path:
    """Write the page and its plot.

    Args:
        league: The league.
        standings: Its result.
        directory: Where to.
        replays: Page of each recorded game, by the number of its run.

    Returns:
        The page.

    Raises:
        MissingExtraError: Matplotlib, Jinja or statsmodels is not installed.
        RecordError: The directory cannot be written.
    """
    sections = [
        table(standings),
        pairings(standings, replays, directory),
        each_against_each(standings),
        how(league, standings),
    ]
    sections = [section for section in sections if not section.is_empty]
    with house_style("the league's page"):
        pictures = {p.name: pictured(p.draw(), f"plot-{p.name}", p.title) for s in sections for p in s.plots}
    best = standings.ratings[0]
    return write_page(
        directory / PAGE, sections, pictures,
        title=f"League of {standings.task}", version=tussle.__version__, source=f"the league {real_path(directory).name}",
        answer=f"{best.name} leads {count(len(standings.ratings), 'player')} after {count(standings.n_games, 'game')}, with "
        f"{signed(best.elo)} Elo ({signed(best.low)} to {signed(best.high)}).",
        notes=[f"{count(standings.n_failed, 'game')} failed and count for nobody."] if standings.n_failed else [],
        needs="Replays lie in the folder runs beside the page",
    )  # fmt: skip


def signed(elo: float) -> str:
    """A rating as it is written: "+87", "−12"."""
    return f"{elo:+.0f}".replace("-", "−")


def table(standings: Standings) -> Section:
    """The section with the ratings."""
    rows = [
        [
            str(place), r.name, signed(r.elo), f"{signed(r.low)} to {signed(r.high)}", count(r.wins + r.draws + r.losses),
            count(r.wins), count(r.draws), count(r.losses), percent((r.wins + 0.5 * r.draws) / max(1, r.wins + r.draws + r.losses)),
        ]
        for place, r in enumerate(standings.ratings, 1)
    ]  # fmt: skip
    columns = [
        ("", "number"),
        ("player", "text"),
        *numbers("Elo", "95 % interval", "games", "won", "drawn", "lost", "points"),
    ]
    caption = "Points: wins and half of the draws, as a share of the games. 400 Elo are odds of ten to one; the mean of all players is 0."
    plot = Plot(
        "ratings", "Ratings", "Dot: rating. Line: its 95 % interval.", lambda: ratings_plot(standings)
    )
    return Section("table", "Table", plots=[plot], tables=[ReportTable("", columns, rows, caption)])


def ratings_plot(standings: Standings) -> Figure:
    """Ratings with their intervals, best on top."""
    figure, ((axes,),) = blank(0.7 + 0.3 * len(standings.ratings))
    rows = range(len(standings.ratings))[::-1]
    for row, r in zip(rows, standings.ratings, strict=True):
        axes.hlines(row, r.low, r.high, color=INK, linewidth=1.1)
        axes.plot(r.elo, row, "o", color=TEAM_COLOURS[0])
    axes.set_yticks(list(rows), [r.name for r in standings.ratings])
    axes.set_ylim(-0.6, len(standings.ratings) - 0.4)
    axes.set_xlabel("Elo")
    rule_x(axes)
    return figure


def pairings(standings: Standings, replays: dict[int, Path], directory: Path) -> Section:
    """The section with the result of each pair."""
    rows: list[list[str | tuple[str, str]]] = []
    for p in standings.pairings:
        page = replays.get(p.decider)
        game = (
            ("", "#pairings")
            if page is None
            else (f"replay of game {p.decider}", page.relative_to(directory).as_posix())
        )
        result = f"{p.a} as {p.sides} " + (
            f"wins by {number(p.margin)}"
            if p.margin > 0
            else f"loses by {number(-p.margin)}"
            if p.margin < 0
            else "draws"
        )
        rows.append(
            [f"{p.a} – {p.b}", count(p.wins), count(p.draws), count(p.losses), percent(p.share),
             f"{percent(p.low)} to {percent(p.high)}", game, result]
        )  # fmt: skip
    columns = [
        ("pairing", "text"),
        *numbers("won", "drawn", "lost", "points", "95 % interval"),
        ("deciding game", "link"),
        ("its end", "text"),
    ]
    caption = (
        "From the view of the first player; a draw is half a win. Intervals are Wilson's. After the deciding game, who was behind could "
        "not catch up any more."
    )
    return Section("pairings", "Pairings", tables=[ReportTable("", columns, rows, caption)])


def each_against_each(standings: Standings) -> Section:
    """The section with the points of each player against each."""
    names = [r.name for r in standings.ratings]
    if not 2 < len(names) <= MAX_CROSSED:
        return Section("each", "Each against each")
    points = {(p.a, p.b): p.share for p in standings.pairings} | {
        (p.b, p.a): 1.0 - p.share for p in standings.pairings
    }
    rows = [[a, *(percent(points[a, b], 0) if (a, b) in points else "" for b in names)] for a in names]
    caption = "Points of the player of the row against that of the column."
    return Section(
        "each", "Each against each", tables=[ReportTable("", [("", "text"), *numbers(*names)], rows, caption)]
    )


def how(league: League, standings: Standings) -> Section:
    """The section on how the league was played."""
    plan, sides = league.batch.plan, " and ".join(f"{t.learners} ({name})" for name, t in league.sides)
    facts = [
        ("task", f"{standings.task}: {sides}"),
        ("who wins", f"the learners of {standings.task} where {standings.margin} > 0, their opponents where it is < 0"),
        ("games", f"{count(plan.n_runs)}, seeds {plan.first_seed} to {plan.seed(plan.n_runs - 1)}"),
        *((p.name, Path(p.path).name if p.path else "the autonomies of the mission") for p in league.players.values()),
        ("ratings", "model of Bradley and Terry (1952), half a win and half a loss added to each pairing (Haldane 1956)"),
        ("intervals", "95 %, from the Fisher information"),
    ]  # fmt: skip
    return Section("how", "How it was played", facts=facts)


__all__ = ["PAGE", "record_game", "write_league_page"]
