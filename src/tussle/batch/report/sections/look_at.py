"""Games that deserve a look: those that failed, and those that took longest; how each is played again."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Sequence

from tussle.batch.report.parts import Column, Section, Table
from tussle.batch.report.subject import Subject
from tussle.batch.report.words import count, number, seconds

MOST_FAILED = 50
MOST_SLOW = 10


def look_at(subject: Subject) -> Section:
    """Games that failed, and those that took longest."""
    results = subject.results
    failed, slowest = results.failed(), results.slowest(MOST_SLOW)
    tables = []
    if failed.num_rows:
        rows = failed.slice(0, MOST_FAILED).to_pylist()
        more = failed.num_rows - len(rows)
        tables.append(
            Table(
                f"{count(failed.num_rows, 'game')} failed",
                (*_run_columns(subject), Column("why", "text"), *_replay_column(subject)),
                tuple(
                    (
                        *_run_cells(subject, r),
                        r["error"] or "",
                        *_replay_cell(subject, r["run"]),
                    )
                    for r in rows
                ),
                "Failed games are in no share, mean or plot."
                + (f" {count(more)} more are in the tables of the batch." if more else ""),
            )
        )
    if slowest.num_rows:
        tables.append(
            Table(
                "Slowest games",
                (*_run_columns(subject), Column("CPU time"), Column("length [s]"), *_replay_column(subject)),
                tuple(
                    (
                        *_run_cells(subject, r),
                        seconds(r["cpu_s"]),
                        number(r["t"]),
                        *_replay_cell(subject, r["run"]),
                    )
                    for r in slowest.to_pylist()
                ),
                "CPU time of a game that was played together with others is its part of theirs.",
            )
        )
    return Section(
        "look-at", "Games to look at", lead=_how_to_replay(subject) if tables else (), tables=tuple(tables)
    )


def _run_columns(subject: Subject) -> tuple[Column, ...]:
    values = (Column("values", "text"),) if subject.has_points else ()
    return (Column("run"), Column("seed"), *values)


def _run_cells(subject: Subject, row: dict[str, object]) -> Iterable[str]:
    yield str(row["run"])
    yield str(row["seed"])
    if subject.has_points:
        yield subject.results.label(int(row["point"]))  # type: ignore[call-overload]


def _can_be_named(subject: Subject) -> bool:
    """The command line can play its runs: it lies in a directory, and its mission in a file."""
    return (
        subject.results.path is not None
        and (subject.results.info.get("mission") or {}).get("made_in") != "python"
    )


def _replay_column(subject: Subject) -> Sequence[Column]:
    return (Column("play it again", "code"),) if _can_be_named(subject) else ()


def _replay_cell(subject: Subject, run: int) -> Sequence[str]:
    path = subject.results.path
    if path is None or not _can_be_named(subject):
        return ()
    return (f"tussle run --from {shlex.quote(f'{path.resolve().name}:{run}')}",)


def _how_to_replay(subject: Subject) -> tuple[str, ...]:
    if not _can_be_named(subject):
        return ()
    return (
        "The commands hold in the folder in which the batch lies. Each tells whether the game ended in the same state again.",
    )
