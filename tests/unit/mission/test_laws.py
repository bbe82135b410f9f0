"""Missions by SCRIMMAGE's own laws: which plugins they have, and that the fact stays with the mission."""

from __future__ import annotations

import subprocess
import sys

import pytest

import tussle.stock as stock
from tussle import Block, Mission, Simulation
from tussle.batch import Batch
from tussle.errors import MissionError
from tussle.mission import Catalogue, read_mission, to_python, to_xml
from tussle.mission.effects import exactly
from tussle.plugins import historic

TEXT = """<runscript name="a"{}>
  <run start="0" end="2" dt="0.1"/>
  <entity><name>a</name><team_id>1</team_id><count>2</count><z>100</z><heading>30</heading>
    <autonomy>Straight</autonomy><controller>SimpleAircraftControllerPID</controller>
    <motion_model max_roll="20">SimpleAircraft</motion_model></entity>
</runscript>"""


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "m.xml"
    path.write_text(TEXT.format(""))
    return path


def played(mission: Mission) -> str:
    with Simulation(mission, 3) as simulation:
        return simulation.run()[0].state_hash


def test_the_laws_of_a_mission_stay_with_it(file, tmp_path):
    """Asked for by an argument, by the file, and in Python; written back as XML and as Python; and in copies."""
    loaded = read_mission(file, compat="scrimmage")
    mission = loaded.mission
    assert type(mission.blocks[0].motion) is historic.load("SimpleAircraft")
    assert mission.blocks[0].motion.max_roll == pytest.approx(0.349, abs=1e-3)
    expected = played(mission)
    assert expected != played(read_mission(file).mission)
    file.write_text(loaded.text)
    again = read_mission(file)
    names: dict[str, object] = {"__name__": "built"}
    exec(to_python(mission), names)
    (tmp_path / "written.xml").write_text(to_xml(mission))
    others = [
        again.mission,
        names["mission"],
        read_mission(tmp_path / "written.xml").mission,
        read_mission(file, compat="").mission.replace(compat="scrimmage"),
        mission.replace(end=2.0),
    ]
    assert [played(each) for each in others] == [expected] * 5
    assert [exactly(each) for each in others] == [exactly(mission)] * 5


def test_without_compat_nothing_historic_is_loaded(file):
    script = (
        "import sys; from tussle.mission import read_mission; from tussle import Simulation\n"
        f"read_mission({str(file)!r}{{}}); print(*(m for m in sys.modules if m.startswith('tussle.plugins.historic.')))"
    )
    printed = [
        subprocess.run(
            [sys.executable, "-c", script.format(more)], capture_output=True, text=True, check=True
        )
        for more in ("", ", compat='scrimmage'")
    ]
    assert printed[0].stdout.split() == []
    assert "tussle.plugins.historic.motion.simple_aircraft" in printed[1].stdout.split()


def test_batches_of_files_and_of_missions_made_in_python(file):
    for source in (file, read_mission(file).mission):
        batch = Batch(source, runs=1, compat="scrimmage")
        assert type(batch.mission.blocks[0].motion) is historic.load("SimpleAircraft")
        assert batch.mission.compat == "scrimmage"
        assert batch.fingerprint != Batch(source, runs=1).fingerprint


def test_own_classes_are_kept():
    class MyAircraft(stock.SimpleAircraft):
        pass

    block = Block(name="a", motion=MyAircraft())
    assert type(Mission(blocks=[block], compat="scrimmage").blocks[0].motion) is MyAircraft


def test_unknown_laws_are_refused(file):
    with pytest.raises(MissionError, match=r"'scrimage' is not allowed \(did you mean 'scrimmage'\?\)"):
        read_mission(file, compat="scrimage")
    file.write_text(TEXT.format('\n compat="old"'))
    with pytest.raises(
        MissionError, match=r"m\.xml:2: compat = 'old' is not allowed; allowed is 'scrimmage'"
    ):
        read_mission(file)
    with pytest.raises(MissionError, match="compat = 1 is not allowed"):
        Mission(blocks=[], compat=1)


def test_a_law_of_scrimmage_alone_cannot_be_written_as_xml():
    mission = Mission(blocks=[Block(name="a", motion=historic.SimpleAircraft())])
    with pytest.raises(MissionError, match="SimpleAircraft has the law of SCRIMMAGE"):
        to_xml(mission)
    assert "from tussle.historic import SimpleAircraft" in to_python(mission)


def test_the_historic_plugins():
    for name in historic.manifest():
        cls = historic.load(name)
        assert historic.load(cls.__name__) is cls  # a name may be an alias
        assert cls.__doc__
        assert cls is Catalogue(compat="scrimmage").load(name)
    assert {name for name in historic.manifest() if name.isidentifier()} <= set(dir(historic))
    with pytest.raises(
        AttributeError, match=r"no attribute 'SimpleAircaft' \(did you mean 'SimpleAircraft'\?\)"
    ):
        historic.SimpleAircaft  # noqa: B018
