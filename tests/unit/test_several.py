"""Arguments that take several texts or paths take one of them alone; it was taken for its letters."""

import pytest

from tussle import Block, Mission
from tussle.batch import Batch, InProcess
from tussle.batch.search.optimization import Optimization
from tussle.mission import read_mission
from tussle.stock import Still

MISSION = Mission(blocks=[Block(name="a", team=1, count=2, motion=Still())], end=0.3)
PLUGIN = "from tussle.stock import Boids\n\n\nclass Own(Boids):\n    '''Mine.'''\n"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("several")
    (made / "own.py").write_text(PLUGIN)
    (made / "own.xml").write_text("<runscript><run start='0' end='1' dt='0.1'/><entity/></runscript>")
    return made


@pytest.fixture(scope="module")
def results():
    return Batch(MISSION, vary="a.count=1,2", runs=2).play(executor=InProcess())


CALLS = {
    "plugin_files of read_mission": (
        lambda given, _: [f.path for f in read_mission("straight_jsbsim", plugin_files=given, plays=False).plugin_files],
        "own.py",
    ),
    "search": (lambda given, _: read_mission("own.xml", search=given).path, ""),
    "plugin_files of Batch": (lambda given, _: [f.path for f in Batch(MISSION, plugin_files=given).plugin_files], "own.py"),
    "vary": (lambda given, _: Batch(MISSION, vary=given).variables, "a.count=1,2"),
    "subject_to": (
        lambda given, _: Optimization(MISSION, "t", vary=["a.count=1,2"], subject_to=given).constraints,
        "alive[1] < 3",
    ),
    "means": (lambda given, results: results.means(given), "alive[1]"),
    "telling": (lambda given, results: results.telling(given), "alive[1]"),
}  # fmt: skip


@pytest.mark.parametrize("name", CALLS)
def test_one_is_the_list_of_one(name, folder, results):
    call, text = CALLS[name]
    given = [folder / text] if "files" in name or name == "search" else [text]
    expected = call(given, results)
    assert call(str(given[0]), results) == expected
    assert call(given[0], results) == expected
