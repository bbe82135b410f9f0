"""Plugins from files that are named."""

from __future__ import annotations

import pickle

import pytest

from tussle import Simulation
from tussle.errors import MissionError
from tussle.mission import load_plugin_file, read_mission

GOOD = '''
from tussle.api import Autonomy, Output, Param


class Ahead(Autonomy):
    """East."""

    v = Param(1.0, unit="m/s")
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    def step(self, g):
        self.velocity[0] = self.v
'''
MISSION = """<runscript><run dt="0.5" end="2"/><entity><autonomy v="3">Ahead</autonomy>
<controller>SingleIntegratorControllerSimple</controller>
<motion_model>SingleIntegrator</motion_model></entity></runscript>"""


def test_a_mission_flies_with_a_plugin_of_a_file(files):
    assert load_plugin_file(files.write(GOOD, "ahead.py")).keys() == {"Ahead"}
    loaded = files.read(MISSION, plugin_files=[files.write(GOOD, "ahead.py")])
    sim = Simulation(loaded.mission)
    sim.run()
    assert loaded.mission.blocks[0].autonomy[0].v == 3.0
    assert pickle.loads(pickle.dumps(loaded.mission)) == loaded.mission
    with pytest.raises(MissionError, match="there is no plugin 'Ahead'"):
        files.read(MISSION)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            "import nothing_of_this_name",
            r"p\.py:1: it cannot be imported: ModuleNotFoundError: No module named",
        ),
        ("\n\ndef f(:\n", r"p\.py:3: it cannot be imported: SyntaxError"),
        ("\n1 / 0\n", r"p\.py:2: it cannot be imported: ZeroDivisionError"),
        ("raise SystemExit(3)", r"p\.py:1: it cannot be imported: SystemExit"),
        ("x = 1", r"p\.py: it defines no plugin"),
        ("from tussle.stock import Boids", r"p\.py: it defines no plugin"),
        (
            "from tussle.api import Autonomy, Param\nclass A(Autonomy):\n    rate = Param(1.0)",
            r"p\.py:2: .*the name is reserved",
        ),
        ("\0", "cannot be imported"),
    ],
)
def test_files_that_do_not_do(files, text, said):
    with pytest.raises(MissionError, match=said):
        read_mission("predator_prey", plugin_files=[files.write(text, "p.py")])


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(MissionError, match="there is no such plugin file"):
        load_plugin_file(tmp_path / "none.py")
    (tmp_path / "p.txt").write_text("x")
    with pytest.raises(MissionError, match="is not a Python file"):
        load_plugin_file(tmp_path / "p.txt")


def test_an_installed_plugin_that_cannot_be_imported(files, monkeypatch):
    from tussle import stock

    monkeypatch.setattr(
        stock, "others", lambda: {"Elsewhere": "no_such_package:Elsewhere", "Wrong": "math:pi"}
    )
    with pytest.raises(
        MissionError, match=r"m\.xml:1: autonomy: plugin 'Elsewhere' cannot be imported: ModuleNotFoundError"
    ):
        files.read("<runscript><entity><autonomy>Elsewhere</autonomy></entity></runscript>")
    with pytest.raises(MissionError, match="which is no plugin class"):
        files.read("<runscript><entity><autonomy>Wrong</autonomy></entity></runscript>")
