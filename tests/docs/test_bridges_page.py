"""The page on other simulators, typed as it stands: with opendis, and with code that protoc generates."""

import os
import re
import socket
import subprocess
import sys

import needs
import numpy as np
import pytest
from pages import FENCE, ROOT
from test_moos_page import type_in

from tussle import load_run

PAGE = ROOT / "docs" / "bridges.md"
FILE = re.compile(r"`([\w.]+\.(?:proto|py|xml))`")


def free_port(kind):
    with socket.socket(socket.AF_INET, kind) as found:
        found.bind(("127.0.0.1", 0))
        return str(found.getsockname()[1])


@pytest.fixture
def page(tmp_path):
    """A function that types a section of the page, with other ports, and returns what the page shows and what came."""

    def read(title, *modules):
        for name in modules:
            if name in needs.NEEDS:
                needs.require(name)
            else:
                pytest.importorskip(name)
        ports = {old: free_port(socket.SOCK_DGRAM) for old in ("3000", "3001", "5000")}
        ports["60000"] = free_port(socket.SOCK_STREAM)
        text = PAGE.read_text().partition(f"\n## {title}\n")[2].partition("\n## ")[0]
        for old, new in ports.items():
            text = text.replace(old, new)
        programs = tmp_path / "bin"
        programs.mkdir()
        for name, call in {"tussle": "-m tussle.cli", "python": ""}.items():
            (programs / name).write_text(f'#!/bin/sh\nexec "{sys.executable}" {call} "$@"\n')
            (programs / name).chmod(0o755)
        environment = {
            **os.environ,
            "PYTHONPATH": os.pathsep.join(path for path in sys.path if path),
            "PATH": f"{programs}{os.pathsep}{os.environ['PATH']}",
        }
        shown = []
        for fence in FENCE.finditer(text):
            if fence[1] == "sh":
                type_in(fence[2], tmp_path, environment)
            elif fence[1] in ("py", "xml", "proto"):
                (tmp_path / FILE.findall(text[: fence.start()])[-1]).write_text(fence[2])
            elif fence[1] == "text":
                shown.append(fence[2])
        return shown, ports

    return read


def test_an_exercise_has_the_scouts_and_the_guest(page, tmp_path):
    shown, _ = page("DIS", "opendis")
    assert (tmp_path / "heard.txt").read_text() == shown[0]
    table = load_run(tmp_path / "exercise").trajectory_table
    guest = np.flatnonzero(table["id"].to_numpy() == 3)
    x, y, t = (table[name].to_numpy()[guest] for name in ("x", "y", "t"))
    assert len(guest)
    assert abs(x - 500).max() < 2
    assert np.polyfit(t, y, 1)[0] == pytest.approx(15, abs=1.5)


def test_the_robot_that_is_told_to_goes(page, tmp_path):
    shown, _ = page("Commands by gRPC", "grpc", "grpc_tools")
    assert (tmp_path / "answers.txt").read_text() == shown[0]
    table = load_run(tmp_path / "robots").trajectory_table
    mine = np.flatnonzero(table["id"].to_numpy() == 2)
    pos = np.stack([table[name].to_numpy()[mine] for name in "xyz"])
    distance = np.linalg.norm(pos - np.array([[200.0], [0.0], [50.0]]), axis=0)
    assert distance[-1] < distance[0] - 5


def test_the_mission_for_flightgear_sends_both_aircraft(page, tmp_path):
    _, ports = page("FlightGear")
    peer = ROOT / "tests" / "unit" / "bridges" / "flightgear_peer.py"
    text = (tmp_path / "scouts.xml").read_text()
    with subprocess.Popen([sys.executable, peer, "20"], stdout=subprocess.PIPE, text=True) as listener:
        port = listener.stdout.readline().strip()
        (tmp_path / "scouts.xml").write_text(text.replace(ports["5000"], port))
        command = [sys.executable, "-m", "tussle.cli", "run", "scouts.xml"]
        done = subprocess.run(command, check=False, cwd=tmp_path, capture_output=True, text=True)
        if done.returncode:  # the listener would wait for ever
            listener.kill()
        heard = listener.stdout.read()
    assert not done.returncode, done.stderr
    assert heard.count('"callsign": "scout"') == 10
    assert heard.count('"callsign": "scout2"') == 10
