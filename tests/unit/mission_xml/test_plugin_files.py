"""Plugins from files that are named."""

from __future__ import annotations

import pickle
import shutil
import sys

import pytest

from tussle import Simulation
from tussle.errors import MissionError
from tussle.mission import PluginFile, load_plugin_file, read_mission
from tussle.testing import check_plugin

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
        ("import nothing_of_this_name", r"p\.py:1: it cannot be imported: ModuleNotFoundError"),
        ("\n\ndef f(:\n", r"p\.py:3: it cannot be imported: SyntaxError"),
        ("\n1 / 0\n", r"p\.py:2: it cannot be imported: ZeroDivisionError"),
        ("raise SystemExit(3)", r"p\.py:1: it cannot be imported: SystemExit"),
        ("x = 1", r"p\.py: it defines no plugin .* and no Task"),
        ("from tussle.stock import Boids", r"p\.py: it defines no plugin .* and no Task"),
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


# -- neighbours ---------------------------------------------------------------------------------------------------------------

IMPORTS = '''
{imports}
from tussle.api import Autonomy, Output

class {name}(Autonomy):
    """Says what its neighbour says."""

    speed = Output(unit="m/s")
    said = {said}

    def step(self, g):
        import lazy
        self.speed[:] = lazy.SPEED
'''


def neighbours(files, folder: str, imports: str = "import geometry", said: str = "geometry.SIDE"):
    """A plugin file in a folder with a neighbour called as in every other folder."""
    files.write(
        f"from constants import SIDE as SIDE\nNAME = __name__\nWHERE = {folder!r}\n", f"{folder}/geometry.py"
    )
    files.write(f"SIDE = {folder!r}\n", f"{folder}/constants.py")
    files.write("SPEED = 3.0\n", f"{folder}/lazy.py")
    files.write("from .round import Round\nfrom ..constants import SIDE\n", f"{folder}/shapes/__init__.py")
    files.write("import geometry\nclass Round:\n    side = geometry.SIDE\n", f"{folder}/shapes/round.py")
    text = IMPORTS.format(imports=imports, said=said, name=folder.title())
    return files.write(text, f"{folder}/plugin.py")


@pytest.mark.parametrize(
    ("imports", "said"),
    [
        ("import geometry", "geometry.SIDE"),
        ("import geometry as g", "g.SIDE"),
        ("from geometry import SIDE", "SIDE"),
        ("from . import geometry", "geometry.SIDE"),
        ("from .geometry import SIDE", "SIDE"),
        ("import shapes.round", "shapes.round.Round.side"),
        ("import shapes.round as r", "r.Round.side"),
        ("from shapes import Round, SIDE", "SIDE"),
        ("import shapes", "shapes.Round.side"),
    ],
)
def test_files_import_their_neighbours_and_nobody_elses(files, imports, said):
    for folder in ("left", "right"):
        plugin = load_plugin_file(neighbours(files, folder, imports, said))[folder.title()]
        assert plugin.said == folder
    assert "geometry" not in sys.modules
    assert not any(str(files.folder) in entry for entry in sys.path)


def test_a_neighbour_is_found_in_a_step_in_the_kit_and_after_pickling(files):
    cls = load_plugin_file(neighbours(files, "left"))["Left"]
    assert pickle.loads(pickle.dumps(cls())) == cls()
    check_plugin(cls)


def test_what_has_changed_is_run_again_and_nothing_else(files):
    path = neighbours(files, "left")
    other = files.write(
        IMPORTS.format(imports="import lazy", said="lazy.SPEED", name="Other"), "left/other.py"
    )
    before, kept = load_plugin_file(path)["Left"], load_plugin_file(other)["Other"]
    assert load_plugin_file(path)["Left"] is before
    files.write("SIDE = 'changed'\n", "left/constants.py")  # which the plugin imports by way of another file
    assert load_plugin_file(path)["Left"].said == "changed"
    assert load_plugin_file(other)["Other"] is kept
    (files.folder / "left/geometry.py").unlink()
    with pytest.raises(MissionError, match=r"plugin\.py:2: it cannot be imported: ModuleNotFoundError"):
        load_plugin_file(path)


def test_a_file_and_its_neighbours_load_where_they_are_not(files):
    path = neighbours(files, "left", "from shapes import Round", "Round.side")
    file = pickle.loads(pickle.dumps(PluginFile.of(path)))
    assert set(file.texts) == {
        "plugin.py", "geometry.py", "constants.py", "lazy.py", "shapes/__init__.py", "shapes/round.py"
    }  # fmt: skip
    shutil.rmtree(files.folder / "left")
    assert file.load()["Left"].said == "left"


def test_tussle_is_never_a_neighbour(files):
    files.write("raise SystemExit", "src/tussle/__init__.py")
    assert load_plugin_file(files.write(GOOD, "src/ahead.py")).keys() == {"Ahead"}


def test_an_error_in_a_neighbour_is_told_with_its_line(files):
    path = neighbours(files, "left")
    files.write("\n1 / 0\n", "left/geometry.py")
    with pytest.raises(MissionError, match=r"left/geometry\.py:2: it cannot be imported: ZeroDivisionError"):
        load_plugin_file(path)
    files.write(b"\xff", "left/geometry.py")
    with pytest.raises(MissionError, match=r"left/geometry\.py: it cannot be read: 'utf-8' codec"):
        load_plugin_file(path)


# -- who has a name -----------------------------------------------------------------------------------------------------------


@pytest.fixture
def distribution(files, monkeypatch):
    """Offers plugins as an installed package does: distribution, name -> "module:class"."""

    def install(package: str, **offered: str) -> None:
        files.write(
            f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n",
            f"{package}/{package}-1.0.dist-info/METADATA",
        )
        points = "".join(f"{name} = {value}\n" for name, value in offered.items())
        files.write(f"[tussle.plugins]\n{points}", f"{package}/{package}-1.0.dist-info/entry_points.txt")
        monkeypatch.syspath_prepend(files.folder / package)

    return install


def test_an_installed_plugin_that_cannot_be_imported(files, distribution):
    distribution(
        "broken", Elsewhere="no_such_package:Elsewhere", Wrong="math:pi", Exits="exits_at_import:Exits"
    )
    files.write("raise SystemExit(3)", "broken/exits_at_import.py")
    for name, said in (
        (
            "Elsewhere",
            r"of the package broken \(no_such_package:Elsewhere\) cannot be imported: ModuleNotFoundError",
        ),
        ("Wrong", r"of the package broken \(math:pi\) is 3\.14.*, which is not a plugin class"),
        ("Exits", r"of .* cannot be imported: SystemExit: 3"),
    ):
        with pytest.raises(MissionError, match=rf"m\.xml:1: autonomy: plugin '{name}' {said}"):
            files.read(f"<runscript><entity><autonomy>{name}</autonomy></entity></runscript>")


def test_files_win_over_packages_and_these_over_what_ships_and_it_is_said_once(files, distribution):
    def boids(path):
        return files.write(GOOD.replace("Ahead", "Boids").replace("1.0", "7.0"), path)

    def read(*plugin_files):
        two = (
            MISSION.replace("<autonomy", "<autonomy>Boids</autonomy><autonomy")
            .replace("Ahead", "Boids")
            .replace(' v="3"', "")
        )
        return files.read(two, plugin_files=plugin_files)

    def origin(loaded):
        return type(loaded.mission.blocks[0].autonomy[0]).__module__

    def hides(loaded):
        return [note for note in loaded.notes if "hides" in note]

    assert (origin(read()), hides(read())) == ("tussle.plugins.stock.autonomy.boids", [])
    distribution("flocks", Boids="my_flocks:Boids")
    boids("flocks/my_flocks.py")
    loaded = read()
    (note,) = hides(loaded)
    assert origin(loaded) == "my_flocks"
    assert note.endswith(
        "Boids is the one of the package flocks (my_flocks:Boids); it hides the one that ships"
    )
    first, second = boids("a/mine.py"), boids("b/mine.py")
    loaded = read(first, first, second)
    (note,) = hides(loaded)
    assert origin(loaded) == PluginFile.of(second).module
    assert note.endswith(
        f"Boids is the one of {second}; it hides the one that ships and the one of the package flocks (my_flocks:Boids) "
        f"and the one of {first}"
    )
