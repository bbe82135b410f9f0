"""The command line, `tussle`; see `tussle --help`."""

import os
import signal


def main() -> None:
    """Entry point of the command."""
    # Until the commands' own handling: an interrupted import ends in a traceback, or in errors of half a module.
    is_usual = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if is_usual:
        signal.signal(signal.SIGINT, lambda *_: os._exit(130))
    from tussle.cli.app import start

    if is_usual:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    start()
