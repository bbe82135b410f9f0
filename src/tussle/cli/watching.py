"""What `tussle view` and `tussle replay` share: options, the address, the wait for Ctrl-C."""

from __future__ import annotations

import math
import os
import sys
import time
import webbrowser
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated

import typer

from tussle.cli.interrupt import Interrupt
from tussle.cli.terminal import OK, TERMINATED, err, out, say, say_error, say_note

if TYPE_CHECKING:
    from tussle.view.page.server import Page

NAP = 0.1  # [s] so that Ctrl-C is heard

Host = Annotated[
    str,
    typer.Option(
        metavar="ADDRESS",
        help="Serve the page at this address of the machine; any but 127.0.0.1 lets others watch and steer who have its whole URL.",
    ),
]
Port = Annotated[
    int | None,
    typer.Option(
        metavar="N",
        min=1,
        max=65535,
        help="Serve it at this port; by default at the first free one from 8123 on.",
        show_default=False,
    ),
]
NoBrowser = Annotated[bool, typer.Option("--no-browser", help="Open no browser, only print the address.")]
Paused = Annotated[bool, typer.Option("--paused", help="Wait at the beginning.")]


def read_pace(text: str | None, default: float | None) -> float | None:
    """`--pace`: simulated seconds per second, None as fast as possible.

    Raises:
        typer.BadParameter: It is neither a number > 0 nor "max".
    """
    if text is None:
        return default
    if text == "max":
        return None
    try:
        pace = float(text)
    except ValueError:
        pace = math.nan
    if not 0.0 < pace < math.inf:
        raise typer.BadParameter(f"--pace {text} is not allowed; it takes a number > 0, or max")
    return pace


def announce(page: Page, is_opened: bool) -> None:
    """Say where the page is, and open it where there is a browser to do so."""
    for note in page.notes:
        say_note(note)
    out().print(f"{page.game.name}: {page.url}  (Ctrl-C ends it)", soft_wrap=True)
    if not page.is_local:
        say(
            "warning",
            f"the page is served at {page.host}: whoever reaches this machine there and has the whole address can watch and"
            " steer the game, and what they send is not encrypted",
            "bold yellow",
        )
    if is_opened and has_screen():
        webbrowser.open(page.url)


def has_screen() -> bool:
    """Whether a browser can be opened: on Linux without a display, only the one that the user names in BROWSER."""
    names = ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")
    return not sys.platform.startswith("linux") or any(os.environ.get(name) for name in names)


def watch(page: Page, interrupt: Interrupt, is_done: Callable[[], bool]) -> int:
    """Wait until Ctrl-C, or until it is done.

    Returns:
        The exit code: Ctrl-C is the way to end it, and no failure. What fails on the page itself is said, and ends nothing.
    """
    told: BaseException | None = None
    n_said = 0
    while not interrupt.code and not is_done():
        for text in page.errors[n_said:]:
            n_said += 1
            say_error(text)
        if page.game_error is not None and page.game_error is not told:
            told = page.game_error
            say_error(str(told))
            err().print("The page shows how it came to that: it can be wound back. Ctrl-C ends it.")
        time.sleep(NAP)
    return TERMINATED if interrupt.code == TERMINATED else OK
