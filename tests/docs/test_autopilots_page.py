"""The page on autopilots: its commands with the peers of `examples/autopilots`, typed as they stand but for ports that are free."""

import os
import re
import socket
import sys

import numpy as np
import pytest
from autopilot_peers import free_ports
from pages import FENCE, ROOT
from test_moos_page import type_in

from tussle import Simulation, load_run
from tussle.mission import read_mission

PAGE = ROOT / "docs" / "autopilots.md"
KINDS = {"ardupilot": ((9002, 9012), socket.SOCK_DGRAM), "px4": ((4560, 4561), socket.SOCK_STREAM)}


@pytest.mark.parametrize("which", KINDS)
@pytest.mark.slow
def test_what_the_page_tells_one_to_type_flies_two_multirotors(tmp_path, which):
    if which == "px4":
        pytest.importorskip("pymavlink")
    (commands,) = (
        f[2] for f in FENCE.finditer(PAGE.read_text()) if f[1] == "sh" and f"--out {which}" in f[2]
    )
    shown, kind = KINDS[which]
    step = shown[1] - shown[0]
    first = free_ports(2, step, kind)
    for k, port in enumerate(shown):
        assert f" {port} " in commands
        commands = commands.replace(f" {port} ", f" {first + k * step} ")
    mission = f"hover_{which}.xml"
    assert mission in commands
    programs = tmp_path / "bin"
    programs.mkdir()
    for name, call in {"tussle": "-m tussle.cli", "python": ""}.items():
        (programs / name).write_text(f'#!/bin/sh\nexec "{sys.executable}" {call} "$@"\n')
        (programs / name).chmod(0o755)
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join(p for p in sys.path if p),
        "PATH": f"{programs}{os.pathsep}{os.environ['PATH']}",
    }
    type_in(commands.replace(mission, f"{mission} --set port={first}"), tmp_path, environment)
    logs = [(tmp_path / f"{name}.log").read_text() for name in ("first", "second")]
    heights = [float(re.search(r": ([\d.]+) m above the start", log)[1]) for log in logs]
    assert heights == pytest.approx([30.0, 20.0], abs=0.1)
    table = load_run(tmp_path / which).trajectory_table
    ids, z = table["id"].to_numpy(), table["z"].to_numpy()
    climbs = [z[ids == k][-1] - z[ids == k][0] for k in (1, 2)]
    assert np.abs(np.subtract(climbs, heights)).max() < 0.3


def test_the_output_that_the_page_shows_has_the_form_of_the_true_one():
    (shown,) = (f[2] for f in FENCE.finditer(PAGE.read_text()) if f[2].startswith("ready\n"))
    assert re.fullmatch(r"(ready\nat 29\.99 s: [23]0\.0\d m above the start\n){2}", shown)


@pytest.mark.parametrize("name", ["ArduCopter", "PX4"])
def test_the_missions_for_real_autopilots_can_be_played(tmp_path, name):
    """Up to the wait for the autopilot: without one, they are read and composed."""
    (text,) = (f[2] for f in FENCE.finditer(PAGE.read_text()) if f[1] == "xml" and f'name="{name}"' in f[2])
    file = tmp_path / "mission.xml"
    file.write_text(text)
    loaded = read_mission(file)
    assert loaded.notes == ()
    with Simulation(loaded.mission) as sim:
        assert sim.steps.tolist() == [0]
