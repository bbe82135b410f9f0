"""The commands of docs/crossing.md: with small numbers, and the short ones as they stand (slow)."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys

import pytest
from pages import FENCE, ROOT

PAGE = (ROOT / "docs/crossing.md").read_text()
MISSION, PLUGIN = ROOT / "examples/stress/crossing.xml", ROOT / "examples/stress/crossing.py"


def commands():
    """Each command of the page, and the block of text below it."""
    fences = [(kind, body) for kind, body in FENCE.findall(PAGE) if kind in ("sh", "text")]
    return [(body, fences[i + 1][1]) for i, (kind, body) in enumerate(fences) if kind == "sh"]


def play(command, folder, code=0):
    """What a command prints, played in a folder beside the examples."""
    if not (folder / "examples").exists():
        (folder / "examples").symlink_to(ROOT / "examples")
    words = shlex.split(command.replace("\\\n", " "))
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}
    done = subprocess.run(
        [sys.executable, "-m", "tussle.cli", *words[1:], *(("--processes", "1") if words[1] == "stress" else ())],
        cwd=folder, env=environment, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == code, done.stderr
    return done.stdout + done.stderr


def small(command):
    """A command with few games, and a distance that is often too small."""
    few = command.replace("--particles 40 --repetitions 6", "--particles 8 --repetitions 2")
    few = re.sub(r"-n \d+", "-n 16", few)
    return few.replace("distance(all, all) > 1 m", "distance(all, all) > 2.6 m").replace(
        "m/s) > 1 m", "m/s) > 2.6 m"
    )


def masked(text):
    """What is the same on every machine, without line breaks: the names of directories hold a hash of the version."""
    return " ".join(re.sub(r"crossing-[0-9a-f]{8}", "crossing-HASH", text).split())


def test_the_page_says_how_long_the_behaviour_is():
    n = len(PLUGIN.read_text().splitlines())
    assert f"in {n} lines" in PAGE
    assert n < 60


def test_the_commands_of_the_page_answer_with_small_numbers(tmp_path):
    plain, rare, mended, searched = [small(command) for command, _ in commands()]
    assert mended == f"{rare.rstrip()} --set memory=2\n"
    plain, rare, searched = [play(command, tmp_path) for command in (plain, rare, searched)]
    assert re.search(r"failed +[1-9]\d* of 16 games", plain)
    assert re.search(r"probability of failure +0\.\d+ \(\S+–\S+\)", rare)
    assert re.search(r"failed +\d+ of 16 games; the same game of the other mission does not", searched)
    worst = re.search(r"tussle run (\S+failures/0.xml)", rare)[1]
    assert re.search(
        r"hash +[0-9a-f]{32}", play(f"tussle run {worst} --plugin-path {shlex.quote(str(PLUGIN))}", tmp_path)
    )


def test_another_crossing_without_noise_has_nothing_rare(tmp_path):
    """One quadrotor in each stream, with exact sensors and a radio that loses nothing, from places without luck."""
    calm = [
        *("tussle", "stress", str(MISSION), "--plugin-path", str(PLUGIN), "--spec", "always (distance(all, all) > 1 m)"),
        *("--probability", "--particles", "4", "--repetitions", "2", "--set", "radio.failure_rate=0"),
        *(word for block in ("east", "north") for value in ("count=1", "sensor=", "use_variance_all_ents=false")
          for word in ("--set", f"{block}.{value}")),
    ]  # fmt: skip
    said = play(shlex.join(calm), tmp_path, code=1)
    assert "all of 8 games with different seeds are equal: the mission has no randomness" in masked(said)


@pytest.mark.slow
@pytest.mark.parametrize("number", [0, 3])
def test_the_short_commands_print_what_the_page_shows(number, tmp_path):
    command, shown = commands()[number]
    assert masked(shown) in masked(play(command, tmp_path))
