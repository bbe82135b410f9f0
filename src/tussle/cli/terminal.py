"""What is said on the terminal, how errors are told, and what exit codes mean."""

from __future__ import annotations

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

from tussle.errors import BatchError, PluginError, RecordError, TussleError, visible

WIDEST = 100
"""Tables and bars grow no wider than this, on the widest of screens."""

OK, WRONG_INPUT, USAGE, PLUGIN_FAILED, NOT_WRITTEN, RUNS_FAILED, OWN_FAULT = 0, 1, 2, 3, 4, 5, 70
INTERRUPTED, TERMINATED = 130, 143

EXIT_CODES = {
    OK: "all went well",
    WRONG_INPUT: "the mission, a setting or a plugin file is wrong",
    USAGE: "the command line is wrong",
    PLUGIN_FAILED: "a plugin failed while the game was played",
    NOT_WRITTEN: "a run or batch directory cannot be written or read",
    RUNS_FAILED: "some runs of a batch failed; its tables hold the others",
    OWN_FAULT: "tussle itself failed: a bug, please report it",
    INTERRUPTED: "interrupted by Ctrl-C; what was played is kept",
    TERMINATED: "the same, by SIGTERM",
}


@cache
def out() -> Console:
    """Where results go."""
    return _console(stderr=False)


@cache
def err() -> Console:
    """Where progress, notes and errors go, so that results can be piped."""
    return _console(stderr=True)


class PlainConsole(Console):
    """A console to which every text is data: nothing in it is markup, and what would steer the terminal is shown as an escape."""

    def __init__(self, stderr: bool) -> None:
        super().__init__(stderr=stderr, highlight=False, emoji=False, markup=False)

    def render_str(self, text: str, **options: Any) -> Text:
        """A string as it is shown."""
        return super().render_str(visible(text), **options)

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """All that is printed comes through here, what is in tables and bars too."""
        if isinstance(renderable, Text) and (shown := visible(renderable.plain)) != renderable.plain:
            renderable = renderable.blank_copy(shown)
        return super().render(renderable, options)


def _console(stderr: bool) -> Console:
    console = PlainConsole(stderr)
    console.width = min(console.width, WIDEST)
    return console


def put(*parts: RenderableType) -> None:
    """Print results. In a file, lines end where their text does."""
    console = out()
    if console.is_terminal:
        for part in parts:
            console.print(part)
        return
    with console.capture() as captured:
        for part in parts:
            console.print(part)
    for line in captured.get().splitlines():
        console.print(line.rstrip(), soft_wrap=True)


def say(label: str, text: str, style: str = "") -> None:
    """A message on the error stream, with its label before each line; on a terminal wrapped between words."""
    console = err()
    for line in text.splitlines() or [""]:
        message = Text.assemble((f"{label}: ", style), line)
        console.print(message, soft_wrap=not console.is_terminal)


def say_error(text: str) -> None:
    """What went wrong, one line each."""
    say("error", text, "bold red")


def say_note(text: str) -> None:
    """What the user should know."""
    say("note", text, "bold yellow")


def code_of(error: BaseException) -> int:
    """The exit code that an error stands for."""
    if isinstance(error, KeyboardInterrupt):
        return INTERRUPTED
    if isinstance(error, PluginError):
        return PLUGIN_FAILED
    if isinstance(error, (BatchError, RecordError, OSError)):
        return NOT_WRITTEN
    return WRONG_INPUT if isinstance(error, TussleError) else OWN_FAULT


@contextmanager
def told(is_debugging: bool) -> Iterator[None]:
    """Ends the command with one message and an exit code where something fails inside; with a traceback when debugging.

    Raises:
        typer.Exit: Something failed, and has been told.
    """
    with warnings.catch_warnings():
        warnings.showwarning = _show_warning
        try:
            yield
        except (
            typer.Exit,
            typer.BadParameter,
            BrokenPipeError,
        ):  # the last: whoever read the output has seen enough
            raise
        except BaseException as error:  # whatever it is, the user gets a message and an exit code
            if isinstance(error, SystemExit):
                raise
            if is_debugging:
                err().print(traceback.format_exc(), soft_wrap=True)
            _tell(error)
            raise typer.Exit(code_of(error)) from None


def _tell(error: BaseException) -> None:
    if isinstance(error, KeyboardInterrupt):
        say("interrupted", "nothing was played", "bold yellow")
    elif isinstance(error, (TussleError, OSError)):
        say_error(str(error))
    else:
        say_error(
            f"tussle itself failed: {type(error).__name__}: {error}\nThis is a bug. --debug shows where it happened."
        )


def _show_warning(message: Warning | str, *_: Any, **__: Any) -> None:
    say("warning", str(message), "bold yellow")


def run_guarded(program: Callable[[], Any]) -> None:
    """Call the program with streams that can print anything: a terminal that lacks a character shows another one."""
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")
    program()
