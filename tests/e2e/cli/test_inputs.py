"""`tussle run --from` and `tussle view --from` play a recorded game with what came from outside."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner

from tussle import Recorder, Simulation, load_run
from tussle.cli.app import app
from tussle.mission import read_mission
from tussle.record import load_inputs
from tussle.view import Live

PLUGIN = '''
from tussle.api import EasyAutonomy, Field, Handle, Message, Output, Param, Subscribe


class Call(Message):
    """Come."""

    to = Field("x y z", "m m m")
    why = Handle()


class Comes(EasyAutonomy):
    """Comes when it is called."""

    calls = Subscribe(Call)
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")
    haste = Param(0.1)

    def step_one(self, me):
        for call in me.calls:
            me.velocity = me.haste * len(call.why) * (call.to - me.pos)
'''
MISSION = """<?xml version="1.0"?>
<runscript name="calls">
  <run start="0.0" end="5.0" dt="0.1"/>
  <entity>
    <name>dogs</name> <team_id>1</team_id> <count>4</count> <x>10</x> <variance_x>30</variance_x>
    <autonomy>Comes</autonomy> <motion_model>SingleIntegrator</motion_model>
  </entity>
</runscript>
"""


@pytest.fixture
def called(tmp_path, monkeypatch):
    """A recorded game in which somebody called twice; its hash."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    Path("calls.xml").write_text(MISSION)
    Path("comes.py").write_text(PLUGIN)
    loaded = read_mission("calls.xml", plugin_files=["comes.py"])
    (call,) = (
        kind for kind in loaded.mission.blocks[0].autonomy[0].columns.values() if hasattr(kind, "message")
    )
    recorder_files = {"mission_text": loaded.text, "plugin_files": loaded.plugin_files}
    with Simulation(loaded.mission, 6) as sim, Recorder(sim, "run", **recorder_files):
        sim.step(10)
        sim.publish(call.message, to=(1.0, 2.0, 3.0), why="now")
        sim.step(15)
        sim.write("dogs.Comes.haste", [[0.5, 0.25, 0.125, 0.1]])
        sim.publish(call.message, to=(-5.0, 0.0, 7.0), why="again")
        sim.run()
        return sim.state_hash()


def tussle(*arguments):
    done = CliRunner().invoke(app, [str(each) for each in arguments])
    assert done.exception is None or isinstance(done.exception, SystemExit), done.exception
    return done.exit_code, done.stdout + done.stderr


def test_a_run_is_played_again_with_them(called):
    code, text = tussle("run", "--from", "run", "--trust", "--out", "again")
    assert code == 0, text
    assert "the end is that of the recording: the same state hash" in text
    assert called in text
    assert load_inputs("again") == load_inputs("run")
    assert load_run("again").inputs["name"].tolist() == ["Call", "dogs.Comes.haste", "Call"]
    shutil.rmtree("again")
    Path("run/inputs.arrow").unlink()
    code, text = tussle("run", "--from", "run", "--trust", "--out", "again")
    assert code != 0
    assert "inputs.arrow" in text
    assert "the game cannot be played again as it was" in " ".join(text.split())


def test_why_a_recording_is_not_whole_is_said_where_it_is_played_again(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    loaded = read_mission("predator_prey", {"run.end": 2.0})
    with Simulation(loaded.mission, 1) as sim, Live(sim, threaded=False) as live:
        recorder = Recorder(sim, "run", mission_text=loaded.text)
        live.step(8)
        live.step_back(4)
        live.remove([1])
        live.step()
        recorder.close()
    why = "the game was rewound or restarted, and took another course"
    assert load_run("run").info["interrupted"] == why
    for command in (("analyze", "run"), ("run", "--from", "run", "--no-log")):
        code, text = tussle(*command)
        assert code == 0, text
        assert why in " ".join(text.split())


def test_a_run_of_a_mission_made_in_python_says_how_it_is_played_again(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with Simulation(read_mission("predator_prey", {"run.end": 0.5}).mission, 1) as sim, Recorder(sim, "run"):
        sim.run()
    Path("run/mission.xml").unlink(missing_ok=True)
    for place in ("run", "run:0"):
        code, text = tussle("run", "--from", place, "--no-log")
        assert code == 1
        assert "the run has no mission.xml: its mission was made in Python" in " ".join(text.split())


def test_a_flipped_bit_is_found(called):
    path = Path("run/inputs.arrow")
    data = bytearray(path.read_bytes())
    data[data.index(b"again")] ^= 1
    path.write_bytes(bytes(data))
    for command in (("check", "run"), ("run", "--from", "run", "--trust")):
        code, text = tussle(*command)
        assert code != 0
        assert "inputs.arrow" in text


def test_view_takes_a_run_or_a_mission(called):
    for arguments, message in (
        (("view",), "a mission or --from BATCH:RUN is required"),
        (("view", "calls.xml", "--from", "run"), "--from BATCH:RUN determines the game"),
        (("view", "--from", "run"), "--trust"),
    ):
        code, text = tussle(*arguments, "--no-browser")
        assert code == 2 or "trust" in message, text
        assert message in " ".join(text.split()), text
    code, text = tussle(
        "view",
        "--from",
        "run",
        "--trust",
        "--no-browser",
        "--exit-when-over",
        "--pace",
        "max",
        "--record",
        "again",
    )
    assert code == 0, text
    assert load_inputs("again") == load_inputs("run")
    assert load_run("again").info["worlds"][0]["state_hash"] == called


def test_the_mission_of_a_run_is_the_game_that_was_played(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for arguments in (
        ("car_maze", "--seed", 5, "--end", "3", "--out", "a"),
        ("a/mission.xml", "--end", "3", "--out", "b"),
    ):
        code, text = tussle("run", *arguments)
        assert code == 0, text
    first, second = (load_run(name).info["worlds"][0] for name in "ab")
    assert (
        (first["seed"], first["state_hash"])
        == (second["seed"], second["state_hash"])
        == (5, first["state_hash"])
    )
