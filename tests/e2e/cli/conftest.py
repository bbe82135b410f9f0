"""The command, run in an empty folder: in this process, or in one of its own."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from cli_process import COMMAND, call, environment

Tussle = Callable[..., "subprocess.CompletedProcess[str]"]

MISSION = """\
<?xml version="1.0"?>
<runscript name="A small game">
  <run start="0" end="${end=3}" dt="0.1"/>
  <seed>7</seed>
  <metrics>SimpleCaptureMetrics</metrics>
  <entity_interaction>SimpleCapture</entity_interaction>
  <entity>
    <name>prey</name> <team_id>1</team_id> <count>${n=10}</count>
    <variance_x>400</variance_x> <variance_y>400</variance_y>
    <autonomy>Boids</autonomy>
    <motion_model use_pitch="true">Unicycle</motion_model>
  </entity>
  <entity>
    <name>hunters</name> <team_id>2</team_id> <count>2</count> <x>60</x>
    <autonomy max_speed="35">${mind=Predator}</autonomy>
    <motion_model use_pitch="true" vel_max="35" turn_rate_max="2">Unicycle</motion_model>
  </entity>
</runscript>
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Where the command runs; it holds game.xml and nothing else."""
    (tmp_path / "game.xml").write_text(MISSION)
    return tmp_path


@pytest.fixture
def process(folder: Path) -> Tussle:
    """Runs the command in the folder, in a process of its own; `code` is the exit code that it must end with."""

    def run(*arguments: str | Path, code: int = 0) -> subprocess.CompletedProcess[str]:
        done = subprocess.run(
            [*COMMAND, *map(str, arguments)],
            check=False, capture_output=True, text=True, cwd=folder, env=environment(),
        )  # fmt: skip
        assert done.returncode == code, (done.returncode, done.stdout, done.stderr)
        return done

    return run


@pytest.fixture
def tussle(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Tussle:
    """The same in this process, which has imported everything already."""
    monkeypatch.chdir(folder)
    monkeypatch.setenv("TERM", "xterm")
    for name in ("FORCE_COLOR", "COLUMNS", "NO_COLOR"):
        monkeypatch.delenv(name, raising=False)

    def run(*arguments: str | Path, code: int = 0) -> subprocess.CompletedProcess[str]:
        done = call(*arguments)
        assert done.returncode == code, (done.returncode, done.stdout, done.stderr)
        return done

    return run
