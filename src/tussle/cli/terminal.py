"""Terminal output, error reporting and exit codes."""

from __future__ import annotations

import errno
import os
import sys
import traceback
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

import typer
from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment
from rich.text import Text

from tussle.errors import BatchError, PluginError, PortError, RecordError, TussleError, visible

WIDEST = 100
"""Largest width of tables and bars, in characters."""
UNKNOWN_WIDTH = 80
"""That for COLUMNS=0, which a shell without a terminal sets."""

OK, WRONG_INPUT, USAGE, PLUGIN_FAILED, NOT_WRITTEN, RUNS_FAILED, DOES_NOT_HOLD, OWN_FAULT = (
    0,
    1,
    2,
    3,
    4,
    5,
    6,
    70,
)
INTERRUPTED, TERMINATED = 130, 143

MAX_LINE = 4000
"""Characters of a line that are shown, about a screen: names and texts of a mission may be as long as its file."""

EXIT_CODES = {
    OK: "success",
    WRONG_INPUT: "error in the mission, a setting or a plugin file",
    USAGE: "error in the command line",
    PLUGIN_FAILED: "a plugin failed during the game",
    NOT_WRITTEN: "a run or batch directory cannot be written or read",
    RUNS_FAILED: "some runs of a batch failed; its tables hold the others",
    DOES_NOT_HOLD: "a specification does not hold as --holds asks",
    OWN_FAULT: "internal error of tussle: a bug, please report it",
    INTERRUPTED: "interrupted by Ctrl-C; results so far are kept",
    TERMINATED: "terminated by SIGTERM; results so far are kept",
}


@cache
def out() -> Console:
    """Console for results."""
    return _console(stderr=False)


@cache
def err() -> Console:
    """Console for progress, notes and errors, separate from results so that those can be piped."""
    return _console(stderr=True)


class PlainConsole(Console):
    """A console that prints every text literally: no markup, and control characters shown as escapes."""

    def __init__(self, stderr: bool) -> None:
        super().__init__(stderr=stderr, highlight=False, emoji=False, markup=False)

    def render_str(self, text: str, **options: Any) -> Text:
        """Render a string with visible control characters."""
        return super().render_str(_shown(text), **options)

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """Render any output, including tables and bars, with visible control characters."""
        if isinstance(renderable, Text) and (shown := _shown(renderable.plain)) != renderable.plain:
            renderable = renderable.blank_copy(shown)
        return super().render(renderable, options)


def _shown(text: str) -> str:
    """A text with visible control characters; of a very long line, its beginning."""
    if len(text) > MAX_LINE:
        lines = (line if len(line) <= MAX_LINE else _shortened(line) for line in text.split("\n"))
        text = "\n".join(lines)
    return visible(text)


def _shortened(line: str) -> str:
    return f"{line[:MAX_LINE]}… and {len(line) - MAX_LINE:,} more characters"


def _console(stderr: bool) -> Console:
    console = PlainConsole(stderr)
    console.width = min(console.width or UNKNOWN_WIDTH, WIDEST)
    return console


def put(*parts: RenderableType) -> None:
    """Print results; a text that does not wrap stays on one line, to be copied. If the output is no terminal, without spaces at ends."""
    console = out()
    if console.is_terminal:
        for part in parts:
            console.print(part, soft_wrap=isinstance(part, Text) and bool(part.no_wrap))
        return
    with console.capture() as captured:
        for part in parts:
            console.print(part, soft_wrap=isinstance(part, Text) and bool(part.no_wrap))
    for line in captured.get().splitlines():
        console.print(line.rstrip(), soft_wrap=True)


def say(label: str, text: str, style: str = "") -> None:
    """Print a message on the error stream, with the label before each line. On a terminal, long lines wrap between words."""
    console = err()
    for line in text.splitlines() or [""]:
        message = Text.assemble((f"{label}: ", style), line)
        console.print(message, soft_wrap=not console.is_terminal)


def say_error(text: str) -> None:
    """Print errors, one per line."""
    say("error", text, "bold red")


def say_note(text: str) -> None:
    """Print a note."""
    say("note", text, "bold yellow")


def code_of(error: BaseException) -> int:
    """Return the exit code of an error."""
    if isinstance(error, KeyboardInterrupt):
        return INTERRUPTED
    if isinstance(error, PluginError) and not isinstance(error.cause, PortError):
        return PLUGIN_FAILED
    if isinstance(error, (BatchError, RecordError, OSError)):
        return NOT_WRITTEN
    return WRONG_INPUT if isinstance(error, TussleError) else OWN_FAULT


@contextmanager
def reported(is_debugging: bool) -> Iterator[None]:
    """Report any error inside as one message and an exit code; with a traceback when debugging.

    Raises:
        typer.Exit: An error occurred and was reported.
    """
    with warnings.catch_warnings():
        warnings.showwarning = _show_warning
        try:
            yield
        except (typer.Exit, typer.BadParameter, BrokenPipeError):  # the last: the reader closed the output
            raise
        except BaseException as error:  # every other error gets a message and an exit code
            if isinstance(error, SystemExit):
                raise
            if is_debugging:
                err().print(traceback.format_exc(), soft_wrap=True)
            _report(error)
            raise typer.Exit(code_of(error)) from None


def _report(error: BaseException) -> None:
    if isinstance(error, KeyboardInterrupt):
        say("interrupted", str(error) or "nothing was played", "bold yellow")
    elif isinstance(error, OSError):
        say_error(_told(error))
    elif isinstance(error, TussleError):
        say_error(str(error))
    else:
        say_error(
            f"internal error: {type(error).__name__}: {error}\nThis is a bug in tussle. --debug shows the traceback."
        )


def _told(error: OSError) -> str:
    is_output = error.filename is None and error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)
    return f"the output cannot be written: {error.strerror}" if is_output else str(error)


def _show_warning(message: Warning | str, *_: Any, **__: Any) -> None:
    say("warning", str(message), "bold yellow")


def run_guarded(program: Callable[[], Any]) -> None:
    """Call the program with output streams that replace characters which the terminal's encoding lacks.

    Raises:
        SystemExit: At its end; what it printed may not have been written.
    """
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")
    code: Any = OK
    error: OSError | None = None
    try:
        program()
    except SystemExit as end:
        code = end.code
    except OSError as reason:  # a page of help that cannot be written
        error = reason
    error = _write_out() or error
    if error is None or code:
        raise SystemExit(code)
    say_error(_told(error))
    raise SystemExit(NOT_WRITTEN)


def _write_out() -> OSError | None:
    """Write what was printed; returns why that cannot be done, None where it can or nobody reads it."""
    try:
        sys.stdout.flush()
    except OSError as error:
        # Python writes the rest at its end, and then tells of the error in its own way.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return None if isinstance(error, BrokenPipeError) else error
    return None
