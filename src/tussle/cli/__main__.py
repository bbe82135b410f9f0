"""`python -m tussle.cli` is `tussle`."""

from tussle.cli import main

main()
