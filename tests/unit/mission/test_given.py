"""A mission, its name or its file, wherever one is taken."""

from __future__ import annotations

import pytest

from tussle import Mission, Simulation, read_mission
from tussle.batch import Batch, optimize
from tussle.errors import MissionError
from tussle.mission import mission_of, to_python, to_xml
from tussle.rl import Task
from tussle.view import scenery_of

TEXT = """<runscript><run end="1" dt="0.1"/>{seed}
  <entity><name>r</name> <team_id>1</team_id> <count>2</count> <variance_x>9</variance_x> <autonomy{more}>Boids</autonomy>
    <motion_model>SingleIntegrator</motion_model></entity>
</runscript>"""


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "game.xml"
    path.write_text(TEXT.format(seed="<seed>7</seed>", more=""))
    return path


def hash_of(*arguments) -> str:
    with Simulation(*arguments) as simulation:
        return simulation.run()[0].state_hash


def test_a_simulation_takes_a_file_as_path_or_text_and_its_seed(file):
    mission = read_mission(file).mission
    assert hash_of(file) == hash_of(str(file)) == hash_of(mission, 7)
    assert hash_of(file, 8) == hash_of(mission, 8) != hash_of(file)
    assert hash_of(mission) == hash_of(mission, 1)
    assert isinstance(Simulation(file).mission, Mission)
    assert Simulation(file, [3, 4]).n_worlds == 2


def test_a_simulation_takes_a_name(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    assert Simulation("predator_prey").mission == read_mission("predator_prey").mission
    assert Simulation("Boids").mission == read_mission("Boids").mission


TAKERS = {
    "Simulation": Simulation,
    "Batch": Batch,
    "optimize": lambda mission: optimize(mission, "score[1]", vary=["r.Boids.max_speed=1:2"], trials=1),
    "to_xml": to_xml,
    "to_python": to_python,
    "scenery_of": scenery_of,
    "Task": lambda mission: Task(mission=mission, learners="prey").given,
    "mission_of": lambda mission: mission_of(mission, "it"),
}


@pytest.mark.parametrize("take", TAKERS.values(), ids=TAKERS)
def test_all_say_what_they_take(take, file, tmp_path):
    with pytest.raises(
        MissionError, match=r"neither a file nor a shipped mission \(did you mean 'predator_prey'\?\)"
    ):
        take("predator_pray")
    with pytest.raises(MissionError, match="is neither a file nor a shipped mission"):
        take(tmp_path / "absent.xml")
    with pytest.raises(
        MissionError, match=r"needs a Mission, the name of one that ships, or a mission file, not 3"
    ):
        take(3)
    with pytest.raises(MissionError, match="not a Loaded: it is in the attribute `mission`"):
        take(read_mission(file))


def test_files_and_names_are_written_and_shown(file):
    mission = read_mission(file).mission
    assert to_xml(file) == to_xml(mission, 7)
    assert to_python(str(file)) == to_python(mission, 7)
    assert repr(scenery_of("predator_prey")) == repr(scenery_of(read_mission("predator_prey").mission))


def test_what_a_file_has_that_is_not_read_is_a_warning_of_the_caller(file):
    text = TEXT.format(seed="", more=' max_spead="3"')
    of_scrimmage = "<stream_port>5555</stream_port>"
    file.write_text(text.replace("</runscript>", f"{of_scrimmage}</runscript>"))
    with pytest.warns(RuntimeWarning, match="unknown") as caught:
        Simulation(file)
    assert "max_spead" in str(caught[0].message)
    assert {warning.filename for warning in caught} == {__file__}
    file.write_text(TEXT.format(seed="", more="").replace("</name>", "</name> <color>1 2 3</color>"))
    Simulation(file)  # a setting of the viewer needs no warning
