"""How the command is called: in a process of its own, or in this one."""

from __future__ import annotations

import io
import os
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout
from functools import cache
from typing import Any

from typer.main import get_command

from tussle.cli import terminal
from tussle.cli.app import app

COMMAND = [sys.executable, "-W", "error", "-m", "tussle.cli"]


def environment() -> dict[str, str]:
    """The worker's own import path, so that an installed package and a source tree are both tested as they are."""
    path = os.pathsep.join(p for p in sys.path if p)
    kept = {k: v for k, v in os.environ.items() if k not in ("FORCE_COLOR", "COLUMNS", "NO_COLOR")}
    return {**kept, "PYTHONPATH": path, "TERM": "xterm"}


@cache
def _command() -> Any:
    """Made once: it takes a tenth of a second."""
    return get_command(app)


def call(*arguments: object) -> subprocess.CompletedProcess[str]:
    """Call the command in this process."""
    terminal.out.cache_clear()
    terminal.err.cache_clear()
    out, err, code = io.StringIO(), io.StringIO(), None
    with redirect_stdout(out), redirect_stderr(err):
        try:
            _command().main([str(each) for each in arguments], prog_name="tussle")
        except SystemExit as ended:
            code = ended.code
    return subprocess.CompletedProcess(arguments, code or 0, out.getvalue(), err.getvalue())
