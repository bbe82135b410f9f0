"""The README shows what the first command really prints."""

import os
import re
import subprocess
import sys

from pages import ROOT

TEXT = (ROOT / "README.md").read_text()


def test_it_fits_two_screens():
    assert len(TEXT.splitlines()) < 120


def test_the_output_of_the_first_command_is_the_real_one():
    shown = re.search(r"^<!-- output -->\n```text\n(.+?)^```$", TEXT, re.MULTILINE | re.DOTALL)
    assert shown
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}
    command = [sys.executable, str(ROOT / "examples" / "01_predator_prey.py")]
    done = subprocess.run(command, check=True, capture_output=True, text=True, env=environment)
    real = done.stdout.splitlines()
    assert shown[1].splitlines()[:-1] == real[:-1]
    # The last line is a measurement: only its words can be the same.
    number = re.compile(r"[\d.]+")
    assert number.sub("", shown[1].splitlines()[-1]) == number.sub("", real[-1])
