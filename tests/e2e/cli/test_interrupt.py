"""Ctrl-C ends the step, writes everything and says so."""

from __future__ import annotations

import signal
import subprocess
import sys
import time

import pytest
from cli_process import COMMAND, environment

from tussle.record import load_run

SLOW = '''\
"""Slow."""

import time

from tussle.stock import Predator


class Slow(Predator):
    """Takes ten minutes to decide, once it is in step 3."""

    def step(self, g):
        if (g.step_count == 3).any():
            print("in step 3", flush=True)
            time.sleep(600)
        super().step(g)
'''


def started(folder, *arguments):
    return subprocess.Popen(
        [*COMMAND, "run", "game.xml", "--out", "out", *arguments],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=folder, env=environment(),
    )  # fmt: skip


def wait_until(condition, seconds=300.0):
    limit = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < limit
        time.sleep(0.02)


def rows_written(folder):
    path = folder / "out" / "trajectory.arrow"
    return path.stat().st_size if path.exists() else 0


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_the_step_is_ended_and_all_is_written(folder, number, code):
    process = started(folder, "--end", "1000", "--pace", "1")
    try:
        wait_until(lambda: rows_written(folder) > 5000)  # the first flush, a second after the start
        process.send_signal(number)
        out, err = process.communicate(timeout=300)
    finally:
        process.kill()
    assert process.returncode == code
    assert err == "interrupted: the current step was finished, and all files were written\n"
    ended = next(line for line in out.splitlines() if line.startswith(" ended"))
    assert ended.startswith(" ended  interrupted, at t = ")
    run = load_run(folder / "out")
    assert not run.is_complete
    assert run.info["interrupted"] == "interrupted"
    assert run.trajectory["t"].max() == pytest.approx(float(ended.split()[-2]))


def test_a_second_one_stops_at_once(folder):
    (folder / "slow.py").write_text(SLOW)
    process = started(folder, "--plugin-path", "slow.py", "--set", "mind=Slow")
    try:
        assert process.stdout.readline() == "in step 3\n"
        process.send_signal(signal.SIGINT)
        time.sleep(0.3)
        assert process.poll() is None
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=300)
    finally:
        process.kill()
    assert process.returncode == 130
    assert "stopped in the middle of a step" in err
    assert not (folder / "out" / "run.json").exists()
    assert not load_run(folder / "out").is_complete


def test_before_the_game_nothing_was_played(folder):
    (folder / "late.py").write_text('print("importing", flush=True)\nimport time\ntime.sleep(600)\n')
    process = started(folder, "--plugin-path", "late.py")
    try:
        assert process.stdout.readline() == "importing\n"
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=300)
    finally:
        process.kill()
    assert process.returncode == 130
    assert err == "interrupted: nothing was played\n"
    assert not (folder / "out").exists()


def test_ctrl_c_while_the_commands_are_imported_ends_quietly():
    program = """
import os, signal, sys
import tussle.cli

class Interrupts:
    def find_spec(self, name, *_):
        if name == "tussle.cli.app":
            os.kill(os.getpid(), signal.SIGINT)

sys.meta_path.insert(0, Interrupts())
tussle.cli.main()
"""
    done = subprocess.run([sys.executable, "-c", program], check=False, capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")
