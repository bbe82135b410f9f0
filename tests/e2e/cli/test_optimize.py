"""tussle optimize: what it shows, how it goes on, how it ends."""

from __future__ import annotations

import json
import re
import shlex
import signal
import subprocess
import time

import pyarrow.parquet as pq
import pytest
from cli_process import COMMAND, environment

SEARCH = (
    *("optimize", "game.xml", "--objective", "score[2]", "--vary", "hunters.Predator.max_speed=5:60"),
    *("--set", "n=40", "--set", "hunters.Unicycle.vel_max=60", "--end", "20"),
    *("-n", "6", "--trials", "12", "--per-round", "6", "--processes", "1"),
)
SMALL = (*SEARCH, "-n", "2", "--trials", "4", "--per-round", "2")

FAILS = '''\
"""Fails."""

from tussle.stock import Predator


class Hasty(Predator):
    """Falls when it is fast."""

    def step(self, g):
        if (self.max_speed > 30).any():
            raise RuntimeError("fell")
        super().step(g)
'''


def row(done, label):
    """A line of the end, with those that continue it."""
    lines = done.stdout.splitlines()
    first = next(i for i, line in enumerate(lines) if line.startswith(f" {label} "))
    width = len(lines[first]) - len(lines[first].removeprefix(f" {label} ").lstrip())
    text = lines[first][width:]
    for line in lines[first + 1 :]:
        if not line.startswith(" " * width):
            break
        text += " " + line[width:]
    return text


def command_of(done):
    """The command that plays the best again: one line, however long."""
    lines = done.stdout.splitlines()
    return lines[next(i for i, line in enumerate(lines) if line.startswith(" next ")) + 1]


def test_faster_hunters_catch_more_and_the_best_can_be_played_again(process, tussle, folder):
    done = process(*SEARCH)
    (path,) = (folder / "optimizations").iterdir()
    assert re.fullmatch(r"game-[0-9a-f]{8}", path.name)
    table = pq.read_table(path / "trials.parquet").to_pylist()
    assert len(table) == 12
    best = max(table, key=lambda r: r["objective"])
    slow = [r for r in table if r["hunters.Predator.max_speed"] < 15]
    assert best["hunters.Predator.max_speed"] > 20
    assert slow
    assert all(r["objective"] < best["objective"] for r in slow)
    assert "A small game" in done.stdout
    assert "maximize score[2] · 12 trials · seeds 1 to 6 · tpe" in done.stdout
    first = done.stdout.splitlines()[6].split()
    assert first[:2] == [str(best["trial"]), str(best["hunters.Predator.max_speed"])]
    assert row(done, "study") == f"optimizations/{path.name}"
    assert row(done, "improved").endswith(f"(trial {best['trial']})")
    command = shlex.split(command_of(done))
    assert command[0] == "tussle"
    assert command[command.index("--seed") + 1] == "7"
    command[command.index("-n") + 1] = "6"
    again = tussle(*command[1:], "--seed", "1", "--out", "again")
    assert "6 runs · seeds 1 to 6" in again.stdout
    results = pq.read_table(folder / "again" / "results.parquet").to_pylist()
    scores = [r["value"] for r in results if r["metric"] == "score" and r["team"] == 2]
    assert scores == best["by_seed"]


def test_the_same_command_goes_on(tussle, folder):
    first = tussle(*SMALL, "--out", "out")
    seen = (folder / "out" / "trials.parquet").stat().st_mtime_ns
    again = tussle(*SMALL, "--out", "out")
    assert "note: 4 of 4 trials were there already, in out" in again.stderr
    assert (folder / "out" / "trials.parquet").stat().st_mtime_ns == seen
    assert "searched" in first.stdout
    assert "searched" not in again.stdout
    more = tussle(*SMALL, "--trials", "6", "--out", "out")
    assert "note: 4 of 6 trials were there already, in out" in more.stderr
    assert "2 trials in" in row(more, "searched")
    error = tussle(*SMALL, "--minimize", "--out", "out", code=4).stderr
    assert "out: holds another search (its direction is 'maximize', not 'minimize')" in error
    assert json.loads((folder / "out" / "study.json").read_text())["command"][0] != ""


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_ctrl_c_keeps_whole_rounds(tussle, folder, number, code):
    arguments = [*SMALL, "--trials", "5000", "--out", "out"]
    process = subprocess.Popen(
        [*COMMAND, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=folder, env=environment()
    )  # fmt: skip
    try:
        limit = time.monotonic() + 300
        while not (folder / "out" / "trials.parquet").exists():
            assert time.monotonic() < limit
            time.sleep(0.05)
        process.send_signal(number)
        out, err = process.communicate(timeout=300)
    finally:
        process.kill()
    assert process.returncode == code
    n = pq.read_table(folder / "out" / "trials.parquet").num_rows
    assert n % 2 == 0
    assert f"interrupted: {n} trials are kept in out; the same command continues" in err
    assert out == ""
    done = tussle(*SMALL, "--trials", str(n + 2), "--out", "out")
    assert f"note: {n} of {n + 2} trials were there already" in done.stderr


def test_failed_trials_are_told(tussle, folder):
    (folder / "hasty.py").write_text(FAILS)
    arguments = [a.replace("Predator.", "Hasty.") for a in SEARCH]
    some = tussle(*arguments, "--set", "mind=Hasty", "--plugin-path", "hasty.py")
    assert re.search(r"note: \d+ of 12 trials failed; the first: seed 1: .*fell", some.stderr)
    assert "--plugin-path hasty.py" in command_of(some)
    arguments = [a.replace("5:60", "31:60") for a in arguments]
    none = tussle(*arguments, "--set", "mind=Hasty", "--plugin-path", "hasty.py", code=3)
    assert re.search(r"error: all trials failed; the first: seed 1: .*fell", none.stderr)
    assert " next " not in none.stdout


def test_noise_is_told(tussle):
    done = tussle(
        "optimize", "game.xml", "--objective", "t", "--vary", "n=5:9:int", "-n", "2", "--trials", "6"
    )
    assert row(done, "lead") == "0 over the next best, paired by seed: within noise"
    assert "note: these games do not show a difference of the best and the next best" in done.stderr
    assert "6 trials of" in done.stdout


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["--vary", "n=1:3"], 2, "--objective is missing"),
        (["--objective", "t"], 2, "--vary is missing"),
        (
            ["--objective", "scor[2]", "--vary", "n=1:3:int"],
            1,
            "there is no 'scor[2]' (did you mean 'score[2]'?)",
        ),
        (["--objective", "t", "--vary", "m=1:3"], 1, "m"),
        (["--objective", "t", "--vary", "n=1:3", "--sampler", "grid"], 1, "sampler = 'grid' is not allowed"),
        (
            ["--objective", "t", "--vary", "n=1:3:int", "--trials", "20000"],
            1,
            "trials = 20000 is not allowed",
        ),
        (["--objective", "t", "--vary", "n=1:3", "--end", "soon"], 1, "--end"),
    ],
)
def test_wrong_command_lines(tussle, folder, arguments, code, message):
    done = tussle("optimize", "game.xml", *arguments, code=code)
    assert message in " ".join(done.stderr.split())
    assert not (folder / "optimizations").exists()
