"""The process of a server of actors."""

import contextlib
import subprocess
import sys
from pathlib import Path


@contextlib.contextmanager
def actor_server(folder, port, *words):
    """Start actor_server.py, wait until it serves, and end it."""
    command = [sys.executable, Path(__file__).with_name("actor_server.py"), folder, str(port), *words]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline() == "ready\n"
        yield process
        process.communicate()
