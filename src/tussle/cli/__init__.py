"""The command line, `tussle`; see `tussle --help`."""

import os
import signal
import sys


def main() -> None:
    """Entry point of the command."""
    _open_streams()
    # Until the commands' own handling: an interrupted import ends in a traceback, or in errors of half a module.
    is_usual = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if is_usual:
        signal.signal(signal.SIGINT, lambda *_: os._exit(130))
    from tussle.cli.app import start

    if is_usual:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    start()


def _open_streams() -> None:
    """Open the null device as each standard stream that was closed: a file opened later would take its number, and what is printed."""
    while (number := os.open(os.devnull, os.O_RDWR)) <= 2:
        os.set_inheritable(number, True)
    os.close(number)
    for number, (name, mode) in enumerate((("stdin", "r"), ("stdout", "w"), ("stderr", "w"))):
        if getattr(sys, name) is None:
            setattr(sys, name, os.fdopen(number, mode, closefd=False))
