"""Tests that need a program which is not installed are skipped, and pytest tells what to install."""

import os
import subprocess
import sys

import needs
import pytest
from tree import ROOT

REASON = "needs Node.js: apt-get install nodejs npm"


@pytest.mark.parametrize("asks_for_all", [False, True])
def test_what_is_skipped_is_told_and_can_be_played_later(tmp_path, asks_for_all):
    skipped = tmp_path / "skipped"
    given = {"PATH": str(tmp_path), "TUSSLE_SKIPPED_TESTS": str(skipped)}
    given |= {"TUSSLE_TEST_ALL": "1"} if asks_for_all else {}
    outer = {k: v for k, v in os.environ.items() if not k.startswith(("TUSSLE_TEST_ALL", "PYTEST_"))}
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-n", "0", "-p", "no:cacheprovider", ROOT / "tests" / "javascript"],
        check=False, capture_output=True, text=True, cwd=ROOT, env=outer | given,
    )  # fmt: skip
    assert REASON in done.stdout
    assert done.returncode == asks_for_all
    if asks_for_all:
        assert "2 failed" in done.stdout
    else:
        assert f"    2  {REASON}\n" in done.stdout
        names = skipped.read_text().splitlines()
        assert len(names) == 2
        assert "tests/javascript/test_javascript.py::test_units_of_the_page" in names


def test_the_packages_of_debian_are_those_of_the_reasons():
    done = subprocess.run([sys.executable, needs.__file__], check=True, capture_output=True, text=True)
    packages = done.stdout.split()
    assert packages == sorted(set(packages))
    for need in needs.NEEDS.values():
        assert bool(need.packages) != bool(need.command)
        assert set(need.packages.split()) <= set(packages)
