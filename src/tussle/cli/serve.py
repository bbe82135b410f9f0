"""`tussle serve`: a mission for programs in any language."""

from __future__ import annotations

import time

from tussle.cli.interrupt import Interrupt
from tussle.cli.play import simulate
from tussle.cli.play_options import ServeOptions
from tussle.cli.progress import compiling
from tussle.cli.terminal import OK, TERMINATED, out
from tussle.pacing import POLL_PERIOD
from tussle.view.serve import Server


def serve(options: ServeOptions) -> int:
    """Serve a mission until Ctrl-C.

    Returns:
        The exit code.
    """
    loaded, mission, seed = options.read()
    with compiling():
        simulation = simulate(loaded, mission, range(seed, seed + options.worlds))
    with (
        simulation,
        Interrupt() as interrupt,
        Server(simulation, host=options.host, port=options.port) as server,
    ):
        out().print(f"{mission.name or loaded.path.stem}: {server.url}  (Ctrl-C ends it)", soft_wrap=True)
        while not interrupt.code:
            time.sleep(POLL_PERIOD)
    return TERMINATED if interrupt.code == TERMINATED else OK
