"""Completion by the shell's own function, as a user who presses TAB meets it."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest
from cli_process import environment

ASK = r"""
source "$1"; shift
COMP_WORDS=("$@"); COMP_CWORD=$(( $# - 1 ))
"$(complete -p tussle | sed 's/.*-F \([^ ]*\).*/\1/')" "$1"
printf '%s\n' "${COMPREPLY[@]}"
"""


@pytest.fixture(scope="module")
def offered(tmp_path_factory):
    """What bash offers for the last word of a command line."""
    folder = tmp_path_factory.mktemp("completion")
    program = folder / "tussle"
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m tussle.cli "$@"\n')
    program.chmod(0o755)
    words = {**environment(), "PATH": f"{folder}{os.pathsep}{os.environ['PATH']}"}
    script = folder / "script"
    shown = subprocess.run(
        [program, "--show-completion", "bash"], check=True, capture_output=True, text=True, env=words
    )
    script.write_text(shown.stdout)
    (folder / "own.py").write_text(
        "from tussle.stock import Predator\n\n\nclass Sly(Predator):\n    '''Is sly.'''\n"
    )

    def ask(*line: str) -> list[str]:
        done = subprocess.run(
            ["bash", "-c", ASK, "bash", script, "tussle", *line],
            check=True, capture_output=True, text=True, env=words, cwd=folder,
        )  # fmt: skip
        assert done.stderr == ""
        return done.stdout.split()

    return ask


@pytest.mark.parametrize(
    ("shell", "mark"),
    [("bash", "complete -o default"), ("zsh", "#compdef tussle"), ("fish", "complete --command tussle")],
)
def test_the_shell_that_is_named_is_the_one_that_is_shown(process, shell, mark):
    assert mark in process("--show-completion", shell).stdout


def test_a_shell_that_has_no_completion_is_refused(process):
    assert "'tcsh' is not one of 'bash', 'zsh', 'fish'" in process("--show-completion", "tcsh", code=2).stderr


def test_bash_completes_missions_and_plugins(offered):
    assert offered("run", "predator_") == ["predator_prey", "predator_prey_jsbsim", "predator_prey_paper"]
    assert offered("run", "Single") == [
        "SingleIntegrator",
        "SingleIntegratorControllerSimple",
        "SingleIntegratorControllerWaypoint",
    ]
    assert offered("describe", "Fie") == ["FieldOfView"]
    assert offered("new", "autonomy", "Mine", "--from", "Boi") == ["Boids"]
    assert offered("run", "absent") == []  # bash goes on with the names of files


def test_bash_completes_the_paths_of_a_mission(offered):
    assert offered("run", "predator_prey", "--set", "prey.Boids.align") == ["prey.Boids.align_weight=0.5"]
    assert offered("view", "predator_prey", "--paused", "--set", "prey=3", "--set", "run.d") == ["run.dt"]
    assert offered("run", "predator_prey", "pr") == [*offered("run", "predator_prey", "--set", "pr")]
    assert "prey=100" in offered("run", "predator_prey", "--set", "pre")
    assert offered("run", "predator_prey", "--set", "prey.Boids.fov_a") == ["prey.Boids.fov_az"]
    assert offered("run", "absent.xml", "--set", "prey") == []
