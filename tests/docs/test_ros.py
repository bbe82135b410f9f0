"""The page about ROS, typed as it stands, by the roscore of the tests."""

import os
import subprocess
import sys

import needs
from pages import FENCE, ROOT


def test_the_robot_of_the_page_moves(roscore, tmp_path):
    needs.require("rostopic")
    page = (ROOT / "docs" / "ros.md").read_text()
    blocks = [(fence[1], fence[2]) for fence in FENCE.finditer(page)]
    (mission,) = (text for language, text in blocks if language == "xml")
    ((number, commands),) = ((i, text) for i, (language, text) in enumerate(blocks) if language == "sh")
    (tmp_path / "cars.xml").write_text(mission)
    tussle = tmp_path / "tussle"
    tussle.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m tussle.cli "$@"\n')
    tussle.chmod(0o755)
    assert commands.startswith("roscore")  # which runs already, at another address
    lines = commands.splitlines()[1:]
    environment = {**os.environ, "PATH": f"{tmp_path}:{os.environ['PATH']}", "PYTHONPATH": str(ROOT / "src")}
    done = subprocess.run(
        ["bash", "-c", "\n".join(lines)],
        check=True, capture_output=True, text=True, cwd=tmp_path, env=environment,
    )  # fmt: skip
    assert blocks[number + 1] == ("text", done.stdout)
