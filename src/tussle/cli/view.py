"""`tussle view`: one game, played live on a page in the browser."""

from __future__ import annotations

import time
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tussle.cli.options import (
    Debug,
    End,
    Large,
    MissionName,
    More,
    PluginFiles,
    Seed,
    Set,
    Strict,
    mission_source,
)
from tussle.cli.terminal import reported
from tussle.cli.watching import Host, NoBrowser, Paused, Port, announce, read_pace, watch

if TYPE_CHECKING:
    from tussle.cli.play import Source

LivePace = Annotated[
    str | None,
    typer.Option(
        metavar="X|max",
        help="Play X times as fast as real time, or as fast as possible; by default as the mission says, or 1.",
        show_default=False,
    ),
]
RecordDirectory = Annotated[
    Path | None,
    typer.Option(
        metavar="DIR", help="Record the game into this directory, as tussle run does.", show_default=False
    ),
]


def view(
    mission: MissionName,
    more: More = None,
    seed: Seed = None,
    settings: Set = None,
    end: End = None,
    pace: LivePace = None,
    paused: Paused = False,
    record: RecordDirectory = None,
    exit_when_over: Annotated[
        bool, typer.Option("--exit-when-over", help="End when the game does, not only by Ctrl-C.")
    ] = False,
    host: Host = "127.0.0.1",
    port: Port = None,
    no_browser: NoBrowser = False,
    strict: Strict = False,
    plugin_files: PluginFiles = None,
    allow_large: Large = False,
    debug: Debug = False,
) -> None:
    """Play one game live on a page in the browser: pause it, step it, wind it back, follow who takes part."""
    wanted = read_pace(pace, None) if pace is not None else 0.0
    with reported(debug):
        source = mission_source(mission, settings, more, seed, end, strict, plugin_files, allow_large)
        code = play_live(
            source, wanted, record, is_paused=paused, is_opened=not no_browser, ends=exit_when_over,
            address={"host": host, "port": port},
        )  # fmt: skip
    raise typer.Exit(code)


def play_live(
    source: Source,
    pace: float | None,
    record: Path | None,
    *,
    is_paused: bool,
    is_opened: bool,
    ends: bool,
    address: dict[str, Any],
) -> int:
    """Play a mission on a page, and show what came of it.

    Args:
        source: The mission and what is set in it.
        pace: Simulated seconds per second; None is as fast as possible, 0 as the mission says.
        record: Where it is recorded; None for nowhere.
        is_paused: Wait before the first step.
        is_opened: Open a browser.
        ends: End when the game does.
        address: Host and port of the page.

    Returns:
        The exit code.

    Raises:
        PluginError: A plugin failed.
    """
    from tussle.cli.interrupt import Interrupt
    from tussle.cli.play import simulate
    from tussle.cli.progress import compiling
    from tussle.cli.summary import Speed, show_summary
    from tussle.view.live import Live
    from tussle.view.page.server import Page

    began = time.perf_counter()
    loaded, mission, seed = source.read(tells_all=False)
    viewer = loaded.viewer
    with ExitStack() as stack:
        with compiling():
            simulation = stack.enter_context(simulate(loaded, mission, seed))
        interrupt = stack.enter_context(Interrupt())
        recorder = None
        if record is not None:
            from tussle.record import Recorder

            # Closed last, and whatever ends the game.
            recorder = stack.enter_context(
                Recorder(simulation, record, mission_text=loaded.text, parameters=loaded.settings)
            )
        live = Live(
            simulation, pace=_warp_of(viewer) if pace == 0.0 else pace, viewer=viewer,
            is_paused=is_paused or bool(viewer.get("start_paused", False)),
        )  # fmt: skip
        stack.callback(live.stop)
        page = stack.enter_context(Page(live, **address))
        announce(page, is_opened)
        speed = Speed(began)
        speed.begin(float(simulation.t[0]))
        code = watch(page, interrupt, lambda: ends and live.is_over)
        page.stop()
        live.stop()
        speed.end(float(simulation.t[0]))
        error = live.error
        if recorder is not None:
            recorder.close(str(error) if error else "" if live.is_over else "ended by who watched")
        show_summary(simulation, loaded.path.stem, speed, recorder.directory if recorder else None)
    if error is not None:
        raise error
    return code


def _warp_of(viewer: dict[str, Any]) -> float | None:
    """The mission's `time_warp`: simulated seconds per second, None as fast as possible; real time where it says nothing."""
    warp = viewer.get("time_warp")
    return 1.0 if warp is None else float(warp) if float(warp) > 0.0 else None
