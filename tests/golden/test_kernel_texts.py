"""The source texts that tussle generates stay the same, byte by byte, unless a law or the generator is meant to change."""

import json
import subprocess
import sys
from pathlib import Path

import pytest


@pytest.mark.slow
def test_generated_texts_are_those_that_are_kept():
    script = Path(__file__).with_name("kernel_texts.py")
    # In a process of its own: a text is generated once per process, some while modules are imported.
    made = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, check=True)
    assert json.loads(made.stdout) == json.loads(script.with_suffix(".json").read_text(encoding="utf-8"))
