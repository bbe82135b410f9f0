"""What a user sees on a terminal of 80 columns, and what a log file gets instead."""

from __future__ import annotations

import os
import pty
import re
import shlex
import subprocess
import termios

import pytest
from cli_process import COMMAND, environment

from tussle.record import load_run

ESCAPE = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]")


def seen(folder, *arguments):
    """All that a terminal of 80 columns gets, escapes included, and the exit code."""
    ours, its = pty.openpty()
    termios.tcsetwinsize(its, (24, 80))
    process = subprocess.Popen(
        [*COMMAND, *arguments], stdin=its, stdout=its, stderr=its, cwd=folder, env=environment()
    )
    os.close(its)
    chunks = []
    while True:
        try:
            chunk = os.read(ours, 65536)
        except OSError:  # the last one who held the terminal has gone
            break
        if not chunk:
            break
        chunks.append(chunk)
    os.close(ours)
    return b"".join(chunks).decode(), process.wait(timeout=300)


def test_a_bar_with_the_speed_is_shown_while_it_plays_and_gone_after(folder):
    text, code = seen(folder, "run", "game.xml", "--no-log", "--pace", "3")
    assert code == 0
    bars = [line for line in re.split(r"[\r\n]", ESCAPE.sub("", text)) if "left" in line and "game" in line]
    assert len(bars) >= 5
    for bar in bars:
        assert re.search(r"game \S.* \d/3 s +\S+ × real time +0:0\d left", bar)
        assert len(bar.rstrip()) <= 80
    assert text.rindex("× real time ") < text.index("A small game") + 2000
    assert "\x1b[2K" in text  # the bar is wiped
    assert "\x1b[?25h" in text  # and the cursor is back


def test_colours_are_for_terminals_only(folder, process):
    text, _ = seen(folder, "run", "nothing.xml")
    assert "\x1b[1;31merror: " in text
    assert "\x1b" not in process("run", "nothing.xml", code=1).stderr


@pytest.mark.slow
def test_the_first_run_ever_says_that_it_compiles_and_the_next_does_not(folder, monkeypatch):
    monkeypatch.setenv("TUSSLE_CACHE_DIR", str(folder / "kernels"))
    monkeypatch.setenv("NUMBA_OPT", "1")  # kernels that came with the package are of another kind
    (folder / "still.xml").write_text(
        '<runscript><run end="1" dt="0.1"/><entity><team_id>1</team_id><motion_model>Still</motion_model></entity></runscript>'
    )
    command = [*COMMAND, "run", "still.xml", "--no-log"]
    runs = [
        subprocess.run(command, check=True, capture_output=True, text=True, cwd=folder, env=environment())
        for _ in range(2)
    ]
    first, last = runs[0].stderr.splitlines()
    assert first.startswith("compiling kernels")
    assert first.endswith(f" {folder / 'kernels'}")
    assert re.fullmatch(r"compiled \d+ kernels? in \d+\.\d s", last)
    assert not runs[1].stderr


def test_a_text_as_long_as_a_file_fills_a_screen_at_most(folder, process):
    text = (folder / "game.xml").read_text()
    (folder / "game.xml").write_text(text.replace('name="A small game"', f'name="{"${x=1}" * 100_000}"'))
    for command in (("run", "game.xml", "--no-log"), ("describe", "game.xml")):
        done = process(*command)
        assert len(done.stdout) + len(done.stderr) < 20_000
        assert "more characters" in done.stdout


@pytest.mark.parametrize("closed", [(0,), (1,), (2,), (0, 1, 2)], ids=str)
def test_closed_streams_are_as_the_null_device(folder, closed):
    """Nothing that is printed gets into a file that would have the number of a closed stream, and the game is recorded whole."""
    shell = " ".join(f"{number}>&-" for number in closed)
    run = f"{shlex.join(COMMAND)} run game.xml --end 1 --out run {shell}"
    done = subprocess.run(
        ["sh", "-c", run], cwd=folder, env=environment(), capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert ("hash" in done.stdout) == (1 not in closed)
    whole = load_run(folder / "run")
    assert whole.notes == []
    assert len(whole.trajectory)
