"""Leaving pdb inside of a plugin is an interruption, not a failure of the plugin."""

from __future__ import annotations

import bdb
import os
import pty
import re
import subprocess

import pytest
from cli_process import COMMAND, environment

from tussle import Block, Mission, Simulation
from tussle.api import EasyAutonomy
from tussle.record import load_run
from tussle.stock import Still

STOPS = '''\
"""Stops in the debugger."""

from tussle.api import EasyAutonomy, Output


class Stops(EasyAutonomy):
    """Calls the debugger in one step."""

    speed = Output(unit="m/s")
    turn_rate = Output(unit="rad/s")
    pitch_rate = Output(unit="rad/s")

    def step_one(self, me):
        me.speed = 1.0
        if me.step_count == STEP:
            breakpoint()
'''


def left_in(folder, step, stdin, send):
    (folder / "stops.py").write_text(STOPS.replace("STEP", str(step)))
    options = ["--plugin-path", "stops.py", "--set", "hunters.autonomy=Stops", "--out", "out", "--end", "60"]
    process = subprocess.Popen(
        [*COMMAND, "run", "game.xml", *options],
        stdin=stdin, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=folder, env=environment(),
    )  # fmt: skip
    send(process)
    out, err = process.communicate()
    return process.returncode, out, err


@pytest.mark.parametrize("step", [0, 12])
def test_q_interrupts_the_game_and_what_was_played_can_be_read(folder, step):
    def send(process):
        process.stdin.write("p me.speed\nq\ny\n")  # from Python 3.14 on, it asks
        process.stdin.flush()

    code, out, err = left_in(folder, step, subprocess.PIPE, send)
    assert code == 130, err
    assert "(Pdb) 1.0" in out
    assert re.search(rf"interrupted: the debugger was left in (Stops|stops.py:\d+), step {step}\n", err)
    assert "note: the game up to there is in out\n" in err
    run = load_run(folder / "out")
    assert (run.is_complete, run.info["interrupted"]) == (False, "interrupted")
    assert run.trajectory["t"].max() == pytest.approx(0.1 * step)


def test_the_end_of_input_on_a_terminal_is_the_same(folder):
    main, other = pty.openpty()
    try:
        code, _, err = left_in(
            folder, 3, other, lambda _: os.write(main, b"\x04\x04")
        )  # the second answers a question, from Python 3.14 on
    finally:
        os.close(main)
        os.close(other)
    assert code == 130, err
    assert re.search(r"interrupted: the debugger was left in (Stops|stops.py:\d+), step 3\n", err)


def test_in_python_it_is_a_keyboard_interrupt():
    class Leaves(EasyAutonomy):
        def step_one(self, me):
            raise bdb.BdbQuit

    game = Mission(blocks=[Block(name="a", count=2, autonomy=Leaves(), motion=Still())])
    for on_error in ("raise", "record"):
        with (
            Simulation(game, on_error=on_error) as simulation,
            pytest.raises(KeyboardInterrupt, match="the debugger was left in Leaves, step 0"),
        ):
            simulation.run()
