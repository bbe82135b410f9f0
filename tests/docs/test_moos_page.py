"""The page on MOOS, typed as it stands: with MOOSDB and pHelmIvP where they are installed, and with those of the tests."""

import contextlib
import os
import re
import signal
import socket
import subprocess
import sys

import needs
import numpy as np
import pytest
from pages import FENCE, ROOT

from tussle import load_run

PAGE = ROOT / "docs" / "moos.md"
FILE = re.compile(r"`([\w.]+\.(?:moos|bhv|xml))`")
PROGRAMS = {"MOOSDB": "moos_database.py", "pHelmIvP": "moos_helm.py"}


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as server:
        return server.getsockname()[1]


@pytest.mark.parametrize("which", ["the tests' own", "installed"])
def test_what_the_page_tells_one_to_type_moves_a_boat(tmp_path, which):
    if which == "installed":
        needs.require("moos")
    programs, folder = tmp_path / "bin", tmp_path / "work"
    programs.mkdir()
    folder.mkdir()
    own = (
        {}
        if which == "installed"
        else {k: f'"{ROOT / "tests" / "unit" / "moos" / v}"' for k, v in PROGRAMS.items()}
    )
    for name, call in {"tussle": "-m tussle.cli", **own}.items():
        (programs / name).write_text(f'#!/bin/sh\nexec "{sys.executable}" {call} "$@"\n')
        (programs / name).chmod(0o755)
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join(p for p in sys.path if p),
        "PATH": f"{programs}{os.pathsep}{os.environ['PATH']}",
    }
    text, port = PAGE.read_text(), str(free_port())
    for fence in FENCE.finditer(text):
        if fence[1] == "sh":
            type_in(fence[2], folder, environment)
        else:
            (folder / FILE.findall(text[: fence.start()])[-1]).write_text(fence[2].replace("9124", port))
    table = load_run(folder / "boat").trajectory_table
    pos = np.stack([table[axis].to_numpy() for axis in "xyz"])
    for point in ((60.0, -40.0), (60.0, -90.0)):
        assert np.hypot(pos[0] - point[0], pos[1] - point[1]).min() < 8.0


def type_in(commands, folder, environment):
    """Run commands in a shell, which leaves no process behind."""
    shell = subprocess.Popen(
        ["bash", "-e", "-c", commands], cwd=folder, env=environment, start_new_session=True, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip
    try:
        printed = shell.communicate()
        assert shell.returncode == 0, (printed, [path.read_text() for path in folder.glob("*.log")])
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(shell.pid, signal.SIGKILL)
