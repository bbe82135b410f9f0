"""Types and unit tests of the page's JavaScript: the commands of `npm test`, where Node.js and TypeScript are installed."""

from __future__ import annotations

import subprocess
from pathlib import Path

import needs

HERE = Path(__file__).parent
ROOT = HERE.parents[1]


def run(program: str, *arguments: str | Path) -> None:
    """Run a program that must succeed."""
    needs.require("node", program)
    done = subprocess.run(
        [needs.program(program), *arguments], check=False, capture_output=True, text=True, cwd=ROOT
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_types_of_the_page_and_of_its_tests():
    run("tsc", "-p", HERE)


def test_units_of_the_page():
    run("node", "--test", *sorted(HERE.glob("*.test.js")))
