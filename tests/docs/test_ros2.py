"""The page about ROS 2, typed as it stands."""

import os
import shutil
import subprocess
import sys

from pages import FENCE, ROOT


def test_the_robot_of_the_page_moves(ros_domain, tmp_path):
    page = (ROOT / "docs" / "ros2.md").read_text()
    blocks = [(fence[1], fence[2]) for fence in FENCE.finditer(page)]
    (mission,) = (text for language, text in blocks if language == "xml")
    ((number, commands),) = ((i, text) for i, (language, text) in enumerate(blocks) if language == "sh")
    (tmp_path / "cars.xml").write_text(mission)
    shutil.copy(ROOT / "examples" / "ros2" / "drive.py", tmp_path)
    for name, arguments in (("tussle", "-m tussle.cli"), ("python", "")):
        (tmp_path / name).write_text(f'#!/bin/sh\nexec "{sys.executable}" {arguments} "$@"\n')
        (tmp_path / name).chmod(0o755)
    environment = {**os.environ, "PATH": f"{tmp_path}:{os.environ['PATH']}", "PYTHONPATH": str(ROOT / "src")}
    done = subprocess.run(
        ["bash", "-c", commands], check=True, capture_output=True, text=True, cwd=tmp_path, env=environment
    )
    assert blocks[number + 1] == ("text", done.stdout)
