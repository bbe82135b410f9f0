"""How the command is called."""

from __future__ import annotations

import os
import sys

COMMAND = [sys.executable, "-W", "error", "-m", "tussle.cli"]


def environment() -> dict[str, str]:
    """The worker's own import path, so that an installed package and a source tree are both tested as they are."""
    path = os.pathsep.join(p for p in sys.path if p)
    kept = {k: v for k, v in os.environ.items() if k not in ("FORCE_COLOR", "COLUMNS", "NO_COLOR")}
    return {**kept, "PYTHONPATH": path, "TERM": "xterm"}
