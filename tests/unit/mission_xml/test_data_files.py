"""Files that missions name without a path: in folders of data, and missing."""

from __future__ import annotations

import pickle
import re

import pytest

from tussle import Block, Mission, Simulation
from tussle.api import MotionModel
from tussle.errors import MissingFileError, MissionError
from tussle.mission.catalogue import KINDS
from tussle.mission.data_files import VARIABLE, DataFiles, data_folders
from tussle.mission.paths import with_value
from tussle.plugins import stock
from tussle.stock import Predator, SingleIntegrator, Unicycle

PIXELS = "P2 3 2 255 0 255 100 0 255 255"
MAP = """<params><filename>wall.pgm</filename><resolution>0.5</resolution><x_origin>10</x_origin><y_origin>20</y_origin>
<z_origin>1</z_origin><wall_bottom_z>2</wall_bottom_z><wall_height>4</wall_height>{}</params>"""
TAG = "<entity_interaction{}>MapGen2D</entity_interaction>"


@pytest.fixture
def data(tmp_path):
    """A folder of data with a map in it, deep."""
    folder = tmp_path / "data" / "gui" / "maps" / "wall"
    folder.mkdir(parents=True)
    (folder / "wall.xml").write_text(MAP.format(""))
    (folder / "wall.pgm").write_text(PIXELS)
    return tmp_path / "data"


def walls(loaded):
    (rules,) = loaded.mission.interactions
    return sorted((wall.center, wall.lengths) for wall in rules.walls())


BLACK = [((10.25, 20.5, 5.0), (0.5, 1.0, 4.0))]


def test_a_map_is_found_by_name_and_only_black_is_a_wall(files, data):
    (data.parent / "m").mkdir()
    files.folder = data.parent / "m"
    loaded = files.world(TAG.format(" map='wall'"), search=[data])
    assert walls(loaded) == BLACK
    assert walls(files.read(loaded.text)) == BLACK


def test_the_environment_names_folders_of_data(files, data, monkeypatch):
    monkeypatch.setenv(VARIABLE, f"/nowhere:{data}")
    (data.parent / "m").mkdir()
    files.folder = data.parent / "m"
    assert walls(files.world(TAG.format(" map='wall'"))) == BLACK


def test_without_it_the_error_says_what_to_set(files):
    with pytest.raises(
        MissionError,
        match=r"m\.xml:2: MapGen2D: there is no file 'wall\.xml' .*--data-path DIR.*SCRIMMAGE_DATA_PATH",
    ):
        files.world(TAG.format(" map='wall'"))


def test_a_map_beside_the_mission_may_have_a_boundary_and_the_tag_comes_before_it(files, data):
    (files.folder / "wall.pgm").write_text(PIXELS)
    (files.folder / "wall.xml").write_text(MAP.format("<enable_map_boundary>true</enable_map_boundary>"))
    found = walls(files.world(TAG.format(" map='wall' height='8'")))
    edges = [
        ((10.75, 20.75, 7.0), (1.5, 0.5, 8.0)), ((10.25, 20.5, 7.0), (0.5, 1.0, 8.0)),
        ((11.75, 20.5, 7.0), (0.5, 1.0, 8.0)), ((10.75, 19.75, 7.0), (1.5, 0.5, 8.0)),
    ]  # fmt: skip
    assert found == sorted([((10.25, 20.5, 7.0), (0.5, 1.0, 8.0)), *edges])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("<params><filename>no.png</filename></params>", "its image 'no.png' is not beside it"),
        ("<params/>", "has no <filename>"),
        ("<params><filname>wall.pgm</filname></params>", "did you mean 'filename'"),
        ("<params>", "not well-formed"),
        ("<!DOCTYPE x><params/>", "a DOCTYPE is not allowed"),
        ("<params><filename>wall.pgm</filename><resolution>x</resolution></params>", "wall.xml: 'x'"),
    ],
)
def test_a_damaged_map_is_told(files, data, text, said):
    (files.folder / "wall.xml").write_text(text)
    (files.folder / "wall.pgm").write_text(PIXELS)
    with pytest.raises(MissionError, match=said):
        files.world(TAG.format(" map='wall'"))


def test_the_threshold_of_a_map_is_cut_to_a_whole_number(files, data):
    (files.folder / "wall.pgm").write_text(PIXELS)
    for text, n_pixels in (("0.65", 2), ("0.99", 2), ("1.0", 6), ("-1", 0)):
        (files.folder / "wall.xml").write_text(MAP.format(f"<occupied_thresh>{text}</occupied_thresh>"))
        area = sum(lengths[0] * lengths[1] for _, lengths in walls(files.world(TAG.format(" map='wall'"))))
        assert area == n_pixels * 0.25


def test_the_first_folder_and_the_least_deep_file_count(tmp_path):
    for name in ("a/x/y/f.txt", "a/z/f.txt", "b/f.txt", "b/s/deep.txt"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(name)
    found = DataFiles(tmp_path / "m", [tmp_path / "a", tmp_path / "b"])
    assert found.find("f.txt").read_text() == "b/f.txt"  # directly in a folder
    assert found.find("z/f.txt").read_text() == "a/z/f.txt"
    assert found.find("elsewhere/deep.txt").read_text() == "b/s/deep.txt"
    assert DataFiles(tmp_path, [tmp_path / "a"]).find("f.txt").read_text() == "a/z/f.txt"
    for name in ("", "nothing", "\0", "a" * 5000):
        with pytest.raises((MissingFileError, OSError)):
            found.find(name)


def test_folders_given_come_before_those_of_the_environment(monkeypatch):
    monkeypatch.setenv(VARIABLE, "/c::/d")
    assert [str(folder) for folder in data_folders(["/a"])] == ["/a", "/c", "/d"]


MOOS = "<entity><autonomy moos_mission_file='~/x/y/bay/targ_a.moos'>MOOSAutonomy</autonomy></entity>"


def test_a_file_that_a_launch_script_of_moos_writes_is_awaited(files, data):
    folder = data / "moos" / "bay"
    folder.mkdir(parents=True)
    (folder / "launch.sh").write_text("")
    text = f"<runscript>{MOOS}</runscript>"
    (plugin,) = files.read(text, search=[data]).mission.blocks[0].autonomy
    assert plugin.awaited.startswith("targ_a.moos, which launch.sh in ")
    (folder / "targ_a.moos").write_text("ServerPort = 9001")
    (plugin,) = files.read(text, search=[data]).mission.blocks[0].autonomy
    assert plugin.awaited == "a community of MOOS-IvP with MOOSDB and helm"
    assert plugin.values["moos_mission_file"] == str(folder / "targ_a.moos")
    with pytest.raises(MissionError, match=r"there is no file '~/x/y/bay/targ_a\.moos'"):
        files.read(text)


FLYER = "<entity><script_name>s.xml</script_name><motion_model>JSBSimModel</motion_model></entity>"


def test_scripts_and_their_aircraft_are_found_or_missed_before_the_game(files, data):
    text = f"<runscript>{FLYER}</runscript>"
    with pytest.raises(MissionError, match=r"JSBSimModel: there is no file 'scripts/s\.xml'"):
        files.read(text)
    (data / "scripts").mkdir()
    (data / "scripts" / "s.xml").write_text(
        '<runscript><use aircraft="Kite" initialize="reset"/></runscript>'
    )
    with pytest.raises(MissionError, match=r"uses the aircraft 'Kite', which is not in"):
        files.read(text, search=[data])
    (data / "aircraft" / "Kite").mkdir(parents=True)
    (data / "aircraft" / "Kite" / "Kite.xml").write_text("<fdm_config/>")
    assert files.read(text, search=[data]).mission.blocks[0].motion.values["jsbsim_root"] == str(data)
    (data / "scripts").rename(data / "others")
    with pytest.raises(MissionError, match="is not in a folder scripts, where JSBSim reads it"):
        files.read(text, search=[data])


def test_terrains_are_found_at_any_depth(files, data):
    folder = data / "gui" / "terrain"
    folder.mkdir()
    (folder / "hills.asc").write_text("ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 2\n3 4\n")
    assert files.world("<terrain>hills.asc</terrain>", search=[data]).mission.scene.terrain is not None


def naming(pattern):
    """Tag, plugin and parameter of each parameter of a stock plugin that is called so and is no truth."""
    for cls in map(stock.load, stock.manifest()):
        tag = next(tag for tag, kind in KINDS.items() if issubclass(cls, kind))
        for name, column in cls.params().items():
            if (
                re.search(pattern, name)
                and not isinstance(column.default, bool)
                and not issubclass(cls, MotionModel)
            ):
                yield tag, cls, name


def tagged(tag, cls, attributes, files):
    text = f"<{tag} {attributes}>{cls.__name__}</{tag}>"
    is_inside = tag in ("autonomy", "sensor", "controller")
    return files.world("" if is_inside else text, "<team_id>1</team_id>" + text * is_inside)


OWNED = {"Boundary"}
"""Plugins whose team is that of a thing, not of entities."""


def test_a_team_that_no_entity_has_is_noted_of_whatever_plugin_names_it(files):
    named = [each for each in naming(r"(^|_)team(_id)?$") if each[1].__name__ not in OWNED]
    assert len(named) >= 9
    for tag, cls, name in named:
        note = f"{cls.__name__}.{name} = 99: no <entity> has this team; there are: 1"
        assert any(note in each for each in tagged(tag, cls, f'{name}="99"', files).notes), note
        assert not any("has this team" in each for each in tagged(tag, cls, f'{name}="1"', files).notes)


def test_a_mission_of_python_is_noted_too_and_one_of_a_file_once(files):
    for tag, cls, name in naming(r"(^|_)team(_id)?$"):
        if cls.__name__ in OWNED:
            continue
        plugin = cls(**{name: type(cls.params()[name].default)(99)})
        is_inside = tag in ("autonomy", "sensor", "controller")
        block = Block(name="a", team=1, motion=SingleIntegrator(), **({tag: plugin} if is_inside else {}))
        kinds = {"entity_interaction": "interactions", "metrics": "metrics", "network": "networks"}
        mission = Mission(blocks=[block], **({} if is_inside else {kinds[tag]: plugin}))
        where = "block 'a'" if is_inside else "mission"
        note = f"{where}: {cls.__name__}.{name} = 99: no block has this team; there are: 1"
        assert list(mission.absent_teams()) == [note]
    block = Block(name="a", team=1, autonomy=Predator(prey_team_id=99), motion=Unicycle())
    with pytest.warns(RuntimeWarning, match="prey_team_id = 99: no block has this team"):
        Simulation(Mission(blocks=[block]).replace(dt=0.2)).close()
    read = tagged("autonomy", Predator, 'prey_team_id="99"', files).mission
    for each in (
        read,
        read.replace(dt=0.2),
        with_value(read, "run.dt", 0.2),
        pickle.loads(pickle.dumps(read)),
    ):
        Simulation(each).close()


def test_a_file_that_is_missing_refuses_the_mission_of_whatever_plugin_names_it(files):
    named = [each for each in naming(r"_file(name)?$") if each[2] != "csv_filename"]  # which is written
    assert {"GraphInteraction", "TrajectoryRecordPlayback", "MOOSAutonomy"} <= {
        cls.__name__ for _, cls, _ in named
    }
    for tag, cls, name in named:
        playing = 'enable_playback="1"' if "enable_playback" in cls.params() else ""
        with pytest.raises(MissionError, match=rf"m\.xml:\d+: {cls.__name__}: .*no (such )?file .*"):
            tagged(tag, cls, f'{name}="nowhere.x" {playing}', files)
    (files.folder / "roads.graphml").write_text("<graphml/>")
    (roads,) = files.world(
        "<entity_interaction graph_file='roads.graphml'>GraphInteraction</entity_interaction>"
    ).mission.interactions
    assert roads.graph_file == str(files.folder / "roads.graphml")
