"""Runs that are cut short leave what had been written, and never pass for complete ones."""

import os
import random
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from tussle import load_run

CHILD = Path(__file__).with_name("recording_child.py")
FLUSH_EVERY = 0.1


def start(*arguments):
    return subprocess.Popen([sys.executable, CHILD, *map(str, arguments)], stdout=subprocess.PIPE, text=True)


def kill_after(seconds, directory):
    """Kill a recorded game some time after its first step; returns the (time there, step) that it told."""
    child = start(directory)
    assert child.stdout.readline() == "begun\n"
    told = []

    def listen():
        whole = (line for line in child.stdout if line.endswith("\n"))
        told.extend((float(t), int(step)) for t, step in map(str.split, whole))

    listener = threading.Thread(target=listen)
    listener.start()
    time.sleep(seconds)
    child.kill()
    child.wait()
    listener.join()
    child.stdout.close()
    return told


@pytest.mark.parametrize("case", range(8))
def test_a_killed_run_loads_and_is_at_most_one_flush_behind(tmp_path, case):
    told = kill_after(random.Random(case).uniform(0.0, 1.0), tmp_path / "run")
    run = load_run(tmp_path / "run")
    assert not run.is_complete
    assert any("run.json is missing" in note for note in run.notes)
    assert run.info == {}
    states = run.trajectory
    # All columns of plugins, of those who have them.
    assert list(run.columns) == ["Boids.target", "Predator.target"]
    is_hunter = states["block"] == "hunters"
    assert (states["Predator.target"].notna() == is_hunter).all()
    assert (states["Boids.target.x"].isna() == is_hunter).all()
    # Whole steps without a gap: as many states of each step and world as there were entities.
    steps = states["step"].unique()
    assert list(steps) == list(range(len(steps)))
    if len(states):
        ends = states.groupby("world")["step"].max()
        assert ends.nunique() == 1
    # By the clock of the game, which a busy machine may stop anywhere: steps were made between the last but one line and the last.
    behind = [step for t, step in told if t <= told[-2:][0][0] - FLUSH_EVERY]
    if behind:
        assert len(steps) > behind[-1]
    deaths = run.events[run.events["kind"] == "death"]
    assert deaths["step"].is_monotonic_increasing


@pytest.mark.parametrize("limit", [100_000, 400_003])
def test_a_full_disk_ends_the_game_with_one_line_and_whole_steps(tmp_path, limit):
    child = start(tmp_path / "run", limit)
    said, _ = child.communicate(timeout=600)
    assert child.returncode == 3
    line = said.splitlines()[-1]
    assert line.startswith(str(tmp_path / "run" / "trajectory.arrow"))
    assert "cannot be written: File too large" in line
    run = load_run(tmp_path / "run")
    assert not run.is_complete
    assert [note.partition(":")[0] for note in run.notes] == ["run.json is missing"]
    n = run.trajectory_table.num_rows
    assert n
    assert f"the {n} rows written before" in line
    assert (run.path / "trajectory.arrow").stat().st_size <= limit


def test_a_disk_that_is_full_before_the_start_is_told_before_the_start(tmp_path):
    said, _ = (child := start(tmp_path / "run", 100)).communicate(timeout=600)
    assert child.returncode == 3
    assert said.count("\n") == 1
    assert "cannot record a run there: File too large" in said


@pytest.mark.skipif(os.geteuid() == 0, reason="nothing is unwritable to the superuser")
def test_a_directory_that_cannot_be_written_is_told_before_the_start(tmp_path):
    tmp_path.chmod(0o500)
    said, _ = (child := start(tmp_path / "run")).communicate(timeout=600)
    tmp_path.chmod(0o700)
    assert child.returncode == 3
    assert said.count("\n") == 1
    assert "cannot record a run there: Permission denied" in said
