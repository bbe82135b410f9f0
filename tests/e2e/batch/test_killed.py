"""A batch that is killed or stopped at any moment, and the same command again: what comes of it is what an undisturbed one gives."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import time
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from cli_process import COMMAND, call, environment

from tussle.batch import Batch, InProcess, load_batch
from tussle.errors import BatchError

PLUGINS = '''\
"""Games that take a while."""

import time

import numpy as np

from tussle.api import Interaction, Metric, State


class Hits(Interaction):
    """Each dies some time."""

    grade = "portable"

    def step(self, w):
        w.kill(w.uniform_by("luck", w.world, w.id, w.id) < 0.1, "bad luck")
        time.sleep(0.01)


class Left(Metric):
    """Those who are left."""

    grade = "portable"
    left = State(per="team")

    def step(self, w):
        self.left[:] = 0.0
        np.add.at(self.left, (w.team_numbers(w.team), w.world), 1.0)

    def result(self, w):
        return {"score": self.left}
'''
MISSION = """\
<?xml version="1.0"?>
<runscript name="Games that take a while">
  <run start="0" end="1" dt="0.1"/>
  <entity_interaction>Hits</entity_interaction>
  <metrics>Left</metrics>
  <entity>
    <name>reds</name> <team_id>1</team_id> <count>${n=4}</count> <motion_model>Still</motion_model>
  </entity>
  <entity>
    <name>blues</name> <team_id>2</team_id> <count>4</count> <motion_model>Still</motion_model>
  </entity>
</runscript>
"""
RUNS = 60
ARGUMENTS = (
    "batch", "game.xml", "--runs", str(RUNS), "--vary", "n=3,4", "--plugin-path", "plugins.py", "--out", "out",
    "--processes", "2", "--stack", "2",
)  # fmt: skip


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "game.xml").write_text(MISSION)
    (tmp_path / "plugins.py").write_text(PLUGINS)
    return tmp_path


def started(folder, *more):
    """The command, in a process group of its own."""
    return subprocess.Popen(
        [*COMMAND, *ARGUMENTS, *more],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=folder, env=environment(), start_new_session=True,
    )  # fmt: skip


def wait_until(condition, process, seconds=300.0):
    """Wait for a moment of the batch; false where the command has ended before it."""
    limit = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < limit
        if process.poll() is not None:
            return False
        time.sleep(0.005)
    return True


def bytes_of_parts(folder):
    return sum(p.stat().st_size for p in (folder / "out" / "parts").glob("*.arrow"))


def members(group):
    """The processes of a group that are there and no zombies, which wait only to be counted."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            fields = (folder / "stat").read_text().rpartition(")")[2].split()
        except OSError:  # it has ended meanwhile
            continue
        if fields[0] != "Z" and int(fields[2]) == group:
            found.append(int(folder.name))
    return found


def workers(process):
    """The processes that play."""
    found = []
    for number in members(process.pid):
        try:
            command = Path(f"/proc/{number}/cmdline").read_bytes()
        except OSError:
            continue
        if b"spawn_main" in command:
            found.append(number)
    return found


def all_gone(group):
    limit = time.monotonic() + 300.0
    while members(group) and time.monotonic() < limit:
        time.sleep(0.02)
    return not members(group)


def end(process, seconds=600.0):
    """Wait for the end: exit code, output, and messages, but for what a slow machine says besides."""
    try:
        out, err = process.communicate(timeout=seconds)
    finally:
        if members(process.pid):
            os.killpg(process.pid, signal.SIGKILL)
    passing = re.compile(r"(?!note|error)[^:]*: [\d,/]+ runs, |compil(ing|ed) ")
    told = [line for line in err.splitlines(keepends=True) if not passing.match(line)]
    return process.returncode, out, "".join(told)


def check_whole(folder):
    """The directory holds what an undisturbed batch of one process gives."""
    found = load_batch(folder / "out")
    batch = Batch(folder / "game.xml", runs=RUNS, vary=["n=3,4"], plugin_files=[folder / "plugins.py"])
    wanted = batch.play(executor=InProcess(64))
    assert found.notes == wanted.notes
    assert found.info["is_complete"]
    columns = ["cpu_s", "host"]
    assert found.table.drop_columns(columns) == wanted.table.drop_columns(columns)
    assert (found.alive, found.design) == (wanted.alive, wanted.design)
    assert not (folder / "out" / "parts").exists()
    assert pq.read_metadata(folder / "out" / "results.parquet").num_rows == wanted.table.num_rows


def n_finished(folder):
    """Runs that the directory has, which can be read at any moment."""
    try:
        return load_batch(folder / "out").n_runs
    except BatchError:  # it was killed before its first run
        return 0


COPIES = re.compile("note: .* are copies of another run .*\n")
STOPS = {
    "it begins": (signal.SIGKILL, lambda folder, _: (folder / "out" / "batch.json").exists()),
    "a terminal": (signal.SIGINT, lambda folder, before: bytes_of_parts(folder) > before + 5000),
    "a batch system": (signal.SIGTERM, lambda folder, before: bytes_of_parts(folder) > before + 5000),
    "the middle": (signal.SIGKILL, lambda folder, _: bytes_of_parts(folder) > 60_000),
    "it ends": (signal.SIGKILL, lambda folder, _: any((folder / "out").glob("alive.parquet*"))),
}  # fmt: skip


@pytest.mark.slow
def test_stopped_again_and_again_with_all_its_processes(folder):
    before = 0
    for name, (number, moment) in STOPS.items():
        process, size = started(folder), bytes_of_parts(folder)
        reached = wait_until(lambda is_time=moment, size=size: is_time(folder, size), process)
        assert reached or name == "it ends"
        os.killpg(process.pid, number)
        code, out, err = end(process)
        assert all_gone(process.pid)
        n = n_finished(folder)
        assert n >= before
        if number != signal.SIGKILL:
            assert (code, out) == (128 + number, "")
            assert err.endswith("interrupted: finished runs are kept in out; the same command continues\n")
            assert n > before
        if name == "the middle":
            assert 0 < n < 2 * RUNS
        before = n
    code, _, err = end(started(folder))
    assert (code, COPIES.sub("", err)) == (0, f"note: {before} of 120 runs were there already, in out\n")
    check_whole(folder)


@pytest.mark.slow
def test_a_process_that_plays_is_killed_while_another_command_comes(folder, monkeypatch):
    process = started(folder)
    assert wait_until(lambda: bytes_of_parts(folder) > 20_000, process)
    os.kill(workers(process)[0], signal.SIGKILL)
    monkeypatch.chdir(folder)
    other = call(*ARGUMENTS)
    said = "error: out: another process is playing this batch\n"
    assert (other.returncode, other.stdout, other.stderr) == (4, "", said)
    code, _, err = end(process)
    assert (code, COPIES.sub("", err)) == (0, "")
    assert all_gone(process.pid)
    check_whole(folder)
