"""`tussle view` and `tussle replay`: games on a page in the browser."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from functools import partial
from typing import TYPE_CHECKING, Any

from tussle.cli.interrupt import Interrupt
from tussle.cli.play import planned_by, record, simulate
from tussle.cli.play_options import PageOptions, RecordedAlarmOptions, ReplayOptions, ViewOptions
from tussle.cli.progress import compiling
from tussle.cli.summary import Speed, show_summary
from tussle.cli.terminal import OK, TERMINATED, err, out, say, say_error, say_note
from tussle.engine.simulation import Simulation
from tussle.mission import Mission
from tussle.pacing import POLL_PERIOD
from tussle.view.link import OperatorLink
from tussle.view.live import Live
from tussle.view.page.access import operator_roles
from tussle.view.page.compare import Comparison
from tussle.view.page.server import Page
from tussle.view.recording import Recording

if TYPE_CHECKING:
    from tussle.stress import Monitor


def view(options: ViewOptions) -> int:
    """Play a mission on a page, and show its result.

    Returns:
        The exit code.

    Raises:
        PluginError: A plugin failed.
    """
    began = time.perf_counter()
    planned = None if options.from_batch is None else planned_by(options)
    link = None if options.link is None else OperatorLink.of_text(options.link)
    loaded, mission, seed = (
        options.read() if planned is None else (planned.loaded, planned.mission, planned.seed)
    )
    viewer = loaded.viewer
    operator_roles(options.operators, {block.team for block in mission.blocks})
    watchings, ground_map = watchings_of(options.spec, mission), options.ground_map
    with ExitStack() as stack:
        with compiling():
            simulation = stack.enter_context(simulate(loaded, mission, seed))
            monitors = [watching(simulation) for watching in watchings]
            for monitor in monitors:
                monitor.check()
        interrupt = stack.enter_context(Interrupt())
        simulation.state.context.is_interrupted = lambda: bool(interrupt.code)
        recorder = None
        if options.record is not None:
            # Closed last, however the game ends.
            recorder = stack.enter_context(
                record(
                    simulation,
                    options.record,
                    loaded,
                    shapes=True,
                    columns=options.record_columns,
                    results=True,
                )
            )
        live = Live(
            simulation,
            pace=_pace_of(viewer) if options.pace is None else options.speed,
            viewer=viewer,
            is_paused=options.paused or bool(viewer.get("start_paused", False)),
            inputs=() if planned is None else planned.inputs,
            link=link,
            specifications=monitors,
            margin=1.0 if options.margin is None else options.margin,
            ground_map=ground_map,
        )
        stack.callback(live.stop)
        page = stack.enter_context(
            Page(
                live,
                host=options.host,
                port=options.port,
                has_roles=options.roles,
                operators=options.operators,
            )
        )
        announce(page, options)
        speed = Speed(began)
        speed.begin(float(simulation.t[0]))
        code = watch(
            page,
            interrupt,
            # KeyboardInterrupt: the user left the debugger.
            lambda: isinstance(live.error, KeyboardInterrupt) or (options.exit_when_over and live.is_over),
        )
        page.stop()
        live.stop()
        speed.end(float(simulation.t[0]))
        error = live.error
        if recorder is not None:
            recorder.close(str(error) if error else "" if live.is_over else "ended by the viewer")
        show_summary(simulation, loaded.path.stem, speed, recorder.directory if recorder else None)
    if error is not None:
        raise error
    return code


def watchings_of(texts: Sequence[str], mission: Mission) -> list[Callable[[Simulation], Monitor]]:
    """What makes the monitors of specifications, which are read before anything is compiled.

    Raises:
        ParameterError: A text is no specification, or names what the mission does not have.
    """
    if not texts:
        return []
    from tussle.stress import Monitor, Specification

    return [partial(Monitor, Specification.parse(text, mission)) for text in dict.fromkeys(texts)]


def _pace_of(viewer: dict[str, Any]) -> float | None:
    """Return the mission's `time_warp`: simulated seconds per second, None for as fast as possible; 1 if it is not given."""
    warp = viewer.get("time_warp")
    return 1.0 if warp is None else float(warp) if float(warp) > 0.0 else None


def replay(options: ReplayOptions) -> int:
    """Show one recorded run on a page, or compare two.

    Returns:
        The exit code.
    """
    runs = [
        Recording(
            path,
            options.world,
            tuple(options.plugin_files),
            is_mapped=True,
            ground_map=options.ground_map,
        )
        for path in (options.run, options.other)
        if path is not None
    ]
    annotate(runs, options)
    game = Comparison(*runs, is_over_each_other=options.over) if len(runs) == 2 else runs[0]
    with ExitStack() as stack:
        interrupt = stack.enter_context(Interrupt())
        page = stack.enter_context(
            Page(game, host=options.host, port=options.port, warp=options.speed, is_paused=options.paused)
        )
        announce(page, options)
        return watch(page, interrupt, lambda: False)


def annotate(runs: Sequence[Recording], options: RecordedAlarmOptions) -> None:
    """Show specifications of recorded games, and marks on the time line of the first.

    Raises:
        ParameterError: A text is no specification, or speaks of what was not recorded.
    """
    for t, text in options.marks:
        runs[0].mark(t, text)
    if not options.spec:
        return
    from tussle.stress import RecordedMonitor

    for run in runs:
        monitors = [RecordedMonitor(text, run) for text in dict.fromkeys(options.spec)]
        run.watch(monitors, 1.0 if options.margin is None else options.margin)


def announce(page: Page, options: PageOptions) -> None:
    """Print the address of the page, and open it in a browser unless that is unwanted or impossible."""
    for note in page.notes:
        say_note(note)
    out().print(f"{page.game.name}: {page.url}  (Ctrl-C ends it)", soft_wrap=True)
    for role, url in list(page.addresses.items())[1:]:
        out().print(f" {role}: {url}", soft_wrap=True)
    if not page.is_local:
        say(
            "warning",
            f"the page is served at {page.host}: whoever reaches this machine there and has the whole address can watch and"
            " steer the game, and what they send is not encrypted",
            "bold yellow",
        )
    if not options.no_browser:
        page.open()


def watch(page: Page, interrupt: Interrupt, is_done: Callable[[], bool]) -> int:
    """Wait until Ctrl-C, or until the game is done. Errors of the page are printed and end nothing.

    Returns:
        The exit code. Ctrl-C is the usual end and therefore a success.
    """
    reported: BaseException | None = None
    n_reported = 0
    while not interrupt.code and not is_done():
        for text in page.errors[n_reported:]:
            n_reported += 1
            say_error(text)
        if page.game_error is not None and page.game_error is not reported:
            reported = page.game_error
            say_error(str(reported))
            err().print("The page can rewind the game to the steps before the error. Ctrl-C ends it.")
        time.sleep(POLL_PERIOD)
    return TERMINATED if interrupt.code == TERMINATED else OK
