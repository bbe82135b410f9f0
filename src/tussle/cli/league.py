"""`tussle league`: rules and policies play each other, and are rated."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import typer
from rich.console import RenderableType
from rich.text import Text

from tussle.batch.executors import Executor, InProcess
from tussle.batch.statistics import scipy_package
from tussle.cli.batch import BatchMeter, command_line, seeds_text
from tussle.cli.interrupt import Interrupt, Interrupted
from tussle.cli.progress import compiling, home_short
from tussle.cli.tables import Row, fact_list, number_tables, title
from tussle.cli.terminal import OK, RUNS_FAILED, put, say, say_note
from tussle.cli.train_options import LeagueOptions
from tussle.errors import BatchError

if TYPE_CHECKING:
    from tussle.rl.league import Standings

JSON = "league.json"


def league(options: LeagueOptions) -> int:
    """Play a league, or the games of it that are missing, and show the table.

    Returns:
        The exit code.
    """
    scipy_package()
    from tussle.rl.league import League
    from tussle.rl.league_page import record_game, write_league_page
    from tussle.rl.policy_file import kept_file

    planned = League(
        options.task, options.players.split(","), games=options.games, seed=options.seed, plugin_files=options.plugin_files
    )  # fmt: skip
    directory = options.directory or Path("leagues") / options.task.rpartition("/")[2]
    with Interrupt() as interrupt:
        try:
            executor: Executor | None = None
            if not planned.batch.is_played_in(directory):
                with compiling():
                    planned.batch.check()
                if options.processes is not None:
                    executor = planned.batch.executor(options.processes, options.stack)
                elif options.stack is not None:
                    executor = InProcess(options.stack)
            with BatchMeter(planned.batch, interrupt) as meter:
                results = planned.batch.play(
                    directory, executor, command=command_line(), on_progress=meter.show_batch
                )
            standings = planned.standings(results)
            replays = {}
            for pairing in standings.pairings:
                interrupt.check()
                if pairing.decider >= 0:
                    replays[pairing.decider] = record_game(planned, results, pairing, directory)
        except (Interrupted, BatchError):
            if not interrupt.code:
                raise
            say(
                "interrupted",
                f"finished games are kept in {directory}; the same command continues",
                "bold yellow",
            )
            return interrupt.code
    page = write_league_page(planned, standings, directory, replays)
    text = json.dumps(standings.as_dict(), indent=1)
    with kept_file(directory / JSON) as part:
        part.write_text(text + "\n", encoding="utf-8")
    if options.as_json:
        typer.echo(text)
    else:
        plan = planned.batch.plan
        put(
            "",
            title(
                f"League of {options.task}",
                f"{standings.n_games:,} games · {seeds_text(plan.first_seed, plan.n_runs)}",
            ),
        )
        put(*tables(standings), fact_list([("page", Text(home_short(page)))]), "")
    if standings.n_failed:
        say_note(
            f"{standings.n_failed:,} games failed and count for nobody; tussle analyze {directory} lists them"
        )
        return RUNS_FAILED
    return OK


def tables(standings: Standings) -> Iterable[RenderableType]:
    """The table of players, and that of pairings."""
    rows: list[Row] = [
        (
            "" if place else "green",
            [r.name, f"{r.elo:+.0f}", f"{r.low:+.0f} – {r.high:+.0f}", f"{r.wins:,}", f"{r.draws:,}", f"{r.losses:,}"],
        )
        for place, r in enumerate(standings.ratings)
    ]  # fmt: skip
    yield from number_tables(["player", "Elo", "95 % interval", "won", "drawn", "lost"], rows)
    rows = [
        ("", [f"{p.a} – {p.b}", f"{p.wins:,}", f"{p.draws:,}", f"{p.losses:,}", f"{100 * p.share:.1f} %",
              f"{100 * p.low:.1f} – {100 * p.high:.1f}"])
        for p in standings.pairings
    ]  # fmt: skip
    yield from number_tables(["pairing", "won", "drawn", "lost", "points", "95 % interval"], rows)
    yield Text(" a draw is half a win", "dim italic")
