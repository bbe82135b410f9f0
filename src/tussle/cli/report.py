"""`tussle report BATCH`: the report of a batch as a page with plots."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tussle.cli.options import Debug
from tussle.cli.progress import home_short
from tussle.cli.terminal import out, reported, say_note

REPORT = "report"
"""Folder of a batch directory that holds its report."""


def report(
    batch: Annotated[
        Path, typer.Argument(metavar="BATCH", help="A batch directory, complete or not.", show_default=False)
    ],
    directory: Annotated[
        Path | None,
        typer.Option(
            "--out",
            metavar="DIR",
            help="Where the page and its plots are written; by default BATCH/report.",
            show_default=False,
        ),
    ] = None,
    quantities: Annotated[
        list[str] | None,
        typer.Option(
            "--quantity",
            metavar="EXPR",
            help="A result that gets plots of its own, such as 'score[2]-score[3]' or t. As often as needed.",
            show_default=False,
        ),
    ] = None,
    debug: Debug = False,
) -> None:
    """Write a page with the results of a batch: who won, what the varied values do, with plots as SVG and PNG."""
    with reported(debug):
        from tussle.batch import load_batch
        from tussle.batch.report import write_report

        written = write_report(load_batch(batch), directory or batch / REPORT, quantities or ())
        for note in written.notes:
            say_note(note)
        n = len(written.plots)
        plots = "1 plot" if n == 1 else f"{n} plots"
        out().print(
            f"{home_short(written.index)} ({plots}, each beside it as SVG and PNG)",
            soft_wrap=True,
        )
