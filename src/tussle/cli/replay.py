"""`tussle replay`: recorded runs on a page in the browser."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer

from tussle.cli.options import Debug, PluginFiles
from tussle.cli.terminal import reported
from tussle.cli.watching import Host, NoBrowser, Paused, Port, announce, read_pace, watch

RunName = Annotated[
    Path, typer.Argument(metavar="RUN", help="A run directory, finished or not.", show_default=False)
]
OtherRun = Annotated[
    Path | None,
    typer.Argument(
        metavar="RUN2",
        help="Another run, seen beside the first from the moment at which they differ.",
        show_default=False,
    ),
]
ReplayPace = Annotated[
    str | None,
    typer.Option(
        metavar="X|max",
        help="Play X times as fast as real time, or as fast as can be seen; by default 1.",
        show_default=False,
    ),
]


def replay(
    run: RunName,
    other: OtherRun = None,
    over: Annotated[
        bool, typer.Option("--over/--side-by-side", help="Draw two runs in one place, or next to each other.")
    ] = False,
    world: Annotated[int, typer.Option(metavar="N", min=0, help="World of a stack.")] = 0,
    pace: ReplayPace = None,
    paused: Paused = False,
    host: Host = "127.0.0.1",
    port: Port = None,
    no_browser: NoBrowser = False,
    plugin_files: PluginFiles = None,
    debug: Debug = False,
) -> None:
    """Play a recorded run on a page in the browser, or two of them from the moment at which they differ."""
    warp = read_pace(pace, 1.0)
    if over and other is None:
        raise typer.BadParameter("--over draws two runs in one place, and there is only one")
    with reported(debug):
        from tussle.cli.interrupt import Interrupt
        from tussle.view.page.compare import Comparison
        from tussle.view.page.server import Page
        from tussle.view.recording import Recording

        files = tuple(plugin_files or ())
        first = Recording(run, world, files, is_mapped=True)
        second = None if other is None else Recording(other, world, files, is_mapped=True)
        game = first if second is None else Comparison(first, second, is_over_each_other=over)
        with ExitStack() as stack:
            interrupt = stack.enter_context(Interrupt())
            page = stack.enter_context(Page(game, host=host, port=port, warp=warp, is_paused=paused))
            announce(page, not no_browser)
            code = watch(page, interrupt, lambda: False)
    raise typer.Exit(code)
