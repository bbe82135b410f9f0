"""The command line, `tussle`; see `tussle --help`."""


def main() -> None:
    """Entry point of the command."""
    from tussle.cli.app import start

    start()
