"""The page about ROS, typed as it stands, by the roscore of the tests."""

import os
import signal
import subprocess
import sys
import time
from xmlrpc.client import ServerProxy

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


def test_what_a_killed_game_leaves_is_removed_by_the_commands_of_the_page(roscore, tmp_path):
    needs.require("rosnode")
    page = (ROOT / "docs" / "ros.md").read_text()
    blocks = [fence[2] for fence in FENCE.finditer(page) if fence[1] == "console"]
    (commands,) = (block for block in blocks if "rosnode cleanup" in block)
    mission = next(fence[2] for fence in FENCE.finditer(page) if fence[1] == "xml")
    (tmp_path / "cars.xml").write_text(mission)
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "src")}

    def topics():
        _, _, (publishers, _, _) = master.getSystemState("/test")
        return {topic for topic, nodes in publishers if any("/tussle_" in node for node in nodes)}

    with ServerProxy(roscore) as master:
        before = topics()
        assert "/entity2/odom" not in before
        game = subprocess.Popen(
            [sys.executable, "-m", "tussle.cli", "run", "cars.xml", "--pace", "1", "--no-log"],
            cwd=tmp_path, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        while (
            not {"/entity2/odom", "/clock"} <= topics()
            or master.getParam("/test", "/use_sim_time")[2] is not True
        ):
            assert game.poll() is None
            time.sleep(0.05)
        game.send_signal(signal.SIGKILL)
        game.wait()
        assert {"/entity2/odom", "/clock"} <= topics()
        assert master.getParam("/test", "/use_sim_time")[2] is True
        for line in commands.splitlines():
            subprocess.run(
                ["bash", "-c", line.removeprefix("$ ")], check=True, capture_output=True, env=environment
            )
        assert topics() == before
        assert master.getParam("/test", "/use_sim_time")[2] is False
