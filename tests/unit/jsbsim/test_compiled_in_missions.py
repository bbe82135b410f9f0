"""Mission files fly JSBSim's aircraft compiled where that gives the same flight, and say where not and why."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tussle import Recorder, Simulation
from tussle.mission import read_mission
from tussle.plugins.stock.motion import jsbsim_model
from tussle.plugins.stock.motion.jsbsim_model import compared
from tussle.stock import JSBSimCompiled, JSBSimControl, JSBSimModel

pytest.importorskip("jsbsim")
HAWK = Path(jsbsim_model.__file__).with_name("hawk")
HELD = '<autonomy speed="25">Straight</autonomy><controller>JSBSimModelControllerHeadingPID</controller>'


@pytest.fixture
def read(tmp_path):
    def made(motion, more="<speed>23</speed>", flown=HELD, **options):
        file = tmp_path / "m.xml"
        file.write_text(mission(motion, more, flown))
        return read_mission(file, **options)

    return made


def mission(motion, more, flown):
    return f"""<runscript><run start="0" end="3" dt="0.1" motion_multiplier="12"/><entity><name>a</name><team_id>1</team_id>
        <count>3</count><x>1000</x><y>500</y><z>300</z><heading>70</heading><variance_x>900</variance_x><variance_y>900</variance_y>
        {more}{flown}<motion_model {motion}</motion_model></entity></runscript>"""


def hawk(more=""):
    return f'script_name="patrol.xml" jsbsim_root="{HAWK}" {more}>JSBSimModel'


SURFACES = '<autonomy speed="50">Straight</autonomy><controller>AircraftPIDController</controller>'


@pytest.mark.parametrize(
    ("motion", "flown", "library"),
    [
        (hawk(), HELD, JSBSimModel),
        ('aircraft="c172p">JSBSimControl', SURFACES, JSBSimControl),
        pytest.param(
            'aircraft="J3Cub" name="cub">JSBSimControl', SURFACES, JSBSimControl, marks=pytest.mark.slow
        ),
    ],
)
def test_an_aircraft_flies_compiled_under_its_own_name_as_in_jsbsim(read, motion, flown, library):
    loaded, kept = read(motion, flown=flown), read(motion.replace(">", ' compiled="false">'), flown=flown)
    fast, slow = loaded.mission.blocks[0].motion, kept.mission.blocks[0].motion
    assert (type(fast), type(slow), fast.instance_name) == (JSBSimCompiled, library, slow.instance_name)
    assert not loaded.notes
    assert not kept.notes
    with Simulation(loaded.mission, [1]) as a, Simulation(kept.mission, [1]) as b:
        start = b.read("a.pos")[0]
        a.run()
        b.run()
        assert np.linalg.norm(b.read("a.pos")[0] - start, axis=-1).min() > 50.0
        np.testing.assert_allclose(a.read("a.pos")[0], b.read("a.pos")[0], atol=1e-4)


@pytest.mark.parametrize(
    ("motion", "more", "why"),
    [
        (hawk(), "", "by the script; give them a <speed>"),
        (hawk('on_failure="remove"'), "<speed>23</speed>", "only JSBSim itself has on_failure = 'remove'"),
        (hawk('wind="3 -2 0"'), "<speed>23</speed>", "only JSBSim itself has wind = (3.0, -2.0, 0.0)"),
        (hawk('processes="2"'), "<speed>23</speed>", "only JSBSim itself has processes = 2"),
        ('aircraft="c172p" trim="full">JSBSimControl', "<vx>50</vx>", "only JSBSim itself has trim = 'full'"),
        ('aircraft="ah1s">JSBSimControl', "<vx>50</vx>", "not supported"),
    ],
)
def test_a_note_says_why_an_aircraft_is_flown_by_jsbsim(read, motion, more, why):
    loaded = read(motion, more)
    assert not isinstance(loaded.mission.blocks[0].motion, JSBSimCompiled)
    (note,) = [note for note in loaded.notes if "is flown by JSBSim and not compiled" in note]
    assert why in note


def test_so_does_a_script_with_events_that_are_not_compiled(read, tmp_path):
    root = tmp_path / "mine"
    shutil.copytree(HAWK, root)
    script = root / "scripts" / "patrol.xml"
    later = '<event><condition>simulation/sim-time-sec ge 2</condition><set name="ap/is_on" value="0"/></event></run>'
    script.write_text(script.read_text().replace("</run>", later))
    loaded = read(hawk().replace(str(HAWK), str(root)))
    assert isinstance(loaded.mission.blocks[0].motion, JSBSimModel)
    assert "only events at the start" in str(loaded.notes)


def test_a_flight_that_is_not_jsbsims_is_not_flown(read, monkeypatch):
    """By a bound that no flight keeps: the figure in the note is that of the comparison."""
    monkeypatch.setattr(compared, "NEAR", 0.0)
    compared.unlike_compiled.cache_clear()
    try:
        loaded = read(hawk())
    finally:
        compared.unlike_compiled.cache_clear()
    assert isinstance(loaded.mission.blocks[0].motion, JSBSimModel)
    assert "after a second, the compiled aircraft is " in str(loaded.notes)


def test_who_only_looks_at_a_run_does_not_call_jsbsim(read, tmp_path):
    with Simulation(read(hawk()).mission, 1) as sim, Recorder(sim, tmp_path / "run"):
        sim.step(2)
    file = tmp_path / "run" / "mission.xml"
    file.write_text(mission(hawk(), "<speed>23</speed>", HELD))
    look = f"""import sys
from tussle.view import Recording
blocks = Recording({str(tmp_path / "run")!r})._loaded.mission.blocks
print(type(blocks[0].motion).__name__, "jsbsim" in sys.modules)"""
    done = subprocess.run([sys.executable, "-c", look], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["JSBSimModel", "False"]


def test_scrimmages_laws_stay_with_jsbsim(read):
    loaded = read(hawk(), compat="scrimmage")
    assert not isinstance(loaded.mission.blocks[0].motion, JSBSimCompiled)
    assert "compiled" not in str(loaded.notes)
