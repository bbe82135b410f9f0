"""The examples run as a user runs them, stay short, and print what they promise."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[2] / "examples"
ALL = sorted(path.name for path in EXAMPLES.glob("*.py"))


def output_of(name: str, *arguments: str) -> list[str]:
    """Lines that an example prints."""
    # The worker's own import path, so that an installed package and a source tree are both tested as they are.
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}
    command = [sys.executable, "-W", "error", str(EXAMPLES / name), *arguments]
    done = subprocess.run(command, check=False, capture_output=True, text=True, env=environment)
    assert done.returncode == 0, done.stderr
    assert not done.stderr
    return done.stdout.splitlines()


def predator_prey(lines):
    header, games, totals = lines[0], lines[1:-2], lines[-2]
    assert header.split()[:3] == ["seed", "prey", "left"]
    assert [int(line.split()[0]) for line in games] == [1, 2, 3]
    won = [sum(f" {end} " in line for line in games) for end in ("team 2", "team 3", "tie")]
    assert totals == f"team 2 won {won[0]}, team 3 won {won[1]}, {won[2]} ties"


def your_own_chaser(lines):
    played, won, lost = map(int, re.findall(r"\d+", lines[-1]))
    assert played == 24
    assert won > lost


def your_own_motion_model(lines):
    captures = [int(n) for n in re.findall(r"(\d+) captures", "\n".join(lines))]
    assert len(captures) == 4
    assert min(captures) >= 2  # the hunters meet the flock within 20 s and keep up with it


def vector_flock(lines):
    orders = [float(x) for x in re.findall(r"order is (\S+)", "\n".join(lines))]
    assert orders[0] < 0.1  # about 1 / sqrt(1000) by chance
    assert orders[-1] > 0.8


def parameter_sweep(lines):
    means = [float(x) for x in re.findall(r": +(\S+) \+-", "\n".join(lines))]
    assert len(means) == 5
    assert means[0] < min(means[1:])


def plan_and_fly(lines):
    known = [int(n) for n in re.findall(r"(\d) walls are known", "\n".join(lines))]
    assert known == sorted(known)
    assert (known[0], known[-1]) == (0, 4)
    assert float(re.findall(r"(\S+) m from its goal", lines[-1])[0]) <= 4.0


PROMISES = {
    "01_predator_prey.py": (predator_prey, ("--seeds", "3", "--end", "120")),
    "02_your_own_chaser.py": (your_own_chaser, ()),
    "03_your_own_motion_model.py": (your_own_motion_model, ()),
    "04_vector_flock.py": (vector_flock, ()),
    "05_parameter_sweep_in_one_stack.py": (parameter_sweep, ()),
    "07_plan_and_fly.py": (plan_and_fly, ()),
}


@pytest.mark.parametrize("name", ALL)
def test_it_is_short_and_its_output_fits_80_columns_and_is_as_promised(name):
    source = (EXAMPLES / name).read_text().splitlines()
    assert len(source) < 60
    assert max(map(len, source)) <= 120
    promise, arguments = PROMISES.get(name, (lambda _: None, ()))
    lines = output_of(name, *arguments)
    assert len(lines) >= 4
    assert max(map(len, lines)) <= 80
    promise(lines)
