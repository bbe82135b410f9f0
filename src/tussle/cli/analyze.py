"""`tussle analyze`: what came of a batch."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tussle.cli.terminal import reported

BatchDirectory = Annotated[
    Path, typer.Argument(metavar="BATCH", help="A batch directory, finished or not.", show_default=False)
]
Quantities = Annotated[
    list[str] | None,
    typer.Option(
        "--quantity",
        metavar="EXPR",
        help="Look at this number: score[2], lost[1]/start[1], wins[2]-wins[3], t. As often as needed; "
        "by default at scores, what is left of the teams, and the time at the end.",
        show_default=False,
    ),
]
Compare = Annotated[
    tuple[str, str] | None,
    typer.Option(
        metavar="A B",
        help="Compare, paired by seed, points with these numbers or values: tactic=keep tactic=switch.",
        show_default=False,
    ),
]
ByPoint = Annotated[bool, typer.Option("--by-point", help="Show all points, not only twenty.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print everything as JSON.")]
Debug = Annotated[bool, typer.Option("--debug", help="Show the traceback of an error.")]


def analyze(
    directory: BatchDirectory,
    quantities: Quantities = None,
    compare: Compare = None,
    by_point: ByPoint = False,
    as_json: AsJson = False,
    debug: Debug = False,
) -> None:
    """Show who won a batch and how sure that is, what differs between points, and what matters."""
    with reported(debug):
        from tussle.cli.analysis_page import show_analysis

        show_analysis(directory, quantities or (), [compare] if compare else (), by_point, as_json)
