"""The examples run as a user runs them, stay short, and print what they promise."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[2] / "examples"
SMALL = {"01_predator_prey.py": ["--seeds", "2", "--end", "60"], "02_your_own_chaser.py": ["4"]}
ALL = sorted(path.name for path in EXAMPLES.glob("*.py"))


def output_of(name: str, arguments: list[str]) -> str:
    # The worker's own import path, so that an installed package and a source tree are both tested as they are.
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}
    command = [sys.executable, "-W", "error", str(EXAMPLES / name), *arguments]
    done = subprocess.run(command, check=False, capture_output=True, text=True, timeout=300, env=environment)
    assert done.returncode == 0, done.stderr
    assert not done.stderr
    return done.stdout


@pytest.mark.parametrize("name", ALL)
def test_it_is_short_and_fits_a_page(name):
    lines = (EXAMPLES / name).read_text().splitlines()
    assert len(lines) < 60
    assert max(map(len, lines)) <= 120


@pytest.mark.parametrize("name", ALL)
def test_it_runs_and_its_output_fits_80_columns(name):
    lines = output_of(name, SMALL.get(name, [])).splitlines()
    assert len(lines) >= 4
    assert max(map(len, lines)) <= 80


def test_the_game_prints_one_line_for_each_seed_and_the_totals():
    lines = output_of("01_predator_prey.py", ["--seeds", "3", "--end", "120"]).splitlines()
    header, games, totals = lines[0], lines[1:-2], lines[-2]
    assert header.split()[:3] == ["seed", "prey", "left"]
    assert [int(line.split()[0]) for line in games] == [1, 2, 3]
    won = [sum(f" {end} " in line for line in games) for end in ("team 2", "team 3", "tie")]
    assert totals == f"team 2 won {won[0]}, team 3 won {won[1]}, {won[2]} ties"


def test_the_game_is_the_same_again_and_in_a_larger_stack():
    fewer, more = (output_of("01_predator_prey.py", ["--seeds", n, "--end", "90"]).splitlines() for n in "24")
    assert fewer[:3] == more[:3]


def test_your_own_chaser_beats_the_stock_predator():
    totals = output_of("02_your_own_chaser.py", []).splitlines()[-1]
    played, won, lost = map(int, re.findall(r"\d+", totals))
    assert played == 24
    assert won > lost


def test_the_planner_captures_with_its_own_model():
    captures = [int(n) for n in re.findall(r"(\d+) captures", output_of("03_your_own_motion_model.py", []))]
    assert len(captures) == 4
    assert min(captures) >= 2  # the hunters meet the flock within 20 s and keep up with it


def test_the_flock_aligns():
    orders = [float(x) for x in re.findall(r"order is (\S+)", output_of("04_vector_flock.py", []))]
    assert orders[0] < 0.1  # about 1 / sqrt(1000) by chance
    assert orders[-1] > 0.8


def test_agile_hunters_catch_more():
    means = [
        float(x) for x in re.findall(r": +(\S+) \+-", output_of("05_parameter_sweep_in_one_stack.py", []))
    ]
    assert len(means) == 5
    assert means[0] < min(means[1:])
