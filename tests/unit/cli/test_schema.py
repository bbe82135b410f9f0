"""The schema of missions accepts what tussle reads, and refuses what is misspelt."""

from __future__ import annotations

from pathlib import Path
from xml.sax.saxutils import quoteattr

import pytest

from tussle.cli.pages import load_plugins
from tussle.cli.schema import mission_schema
from tussle.errors import TussleError
from tussle.mission import read_mission, shipped_missions, to_xml
from tussle.mission.catalogue import KINDS
from tussle.mission.codecs import written
from tussle.plugins import stock

xmlschema = pytest.importorskip("xmlschema", reason="needs xmlschema: pip install '.[test]'")
OF_WORLD = ("entity_interaction", "metrics", "network")
MINE = '''
from tussle.api import Autonomy, Param


class Wander(Autonomy):
    """Goes somewhere else. Nobody knows where."""

    restlessness = Param(0.5, unit="1/s", ge=0.0, doc="Turns per second.")
    mood = Param("calm", choices=("calm", "wild"), doc="How it goes.")
'''


@pytest.fixture(scope="module")
def schema(tmp_path_factory):
    """The schema with the plugins that ship and one of a plugin file."""
    file = tmp_path_factory.mktemp("plugins") / "mine.py"
    file.write_text(MINE)
    found, _, wrong = load_plugins([file])
    assert not wrong
    return xmlschema.XMLSchema10(mission_schema(found))


def mission(world: str = "", inside: str = "") -> str:
    return f"<runscript>{world}<entity>{inside}</entity></runscript>"


def test_all_missions_and_examples_that_ship_are_valid(schema):
    files = [file for file, _ in shipped_missions().values()] + list(stock.examples().values())
    assert len(files) > 100
    wrong = {Path(f).name: [e.reason for e in schema.iter_errors(str(f))] for f in files}
    assert not {name: reasons for name, reasons in wrong.items() if reasons}


@pytest.mark.parametrize("name", shipped_missions())
def test_what_is_written_of_a_mission_is_valid(schema, name):
    loaded = read_mission(name)
    if not loaded.mission.scene.walls:
        text = to_xml(loaded.mission, loaded.seed)
        assert not [error.reason for error in schema.iter_errors(text)]


@pytest.mark.parametrize("name", stock.manifest())
def test_defaults_of_all_plugins_are_valid(schema, name):
    cls = stock.load(name)
    tag = next((tag for tag, kind in KINDS.items() if issubclass(cls, kind)), "behaviors")
    if tag == "behaviors":
        return
    values = {key: written(c.default, c.units, c.text_units) for key, c in cls.params().items()}
    text = f"<{tag} {' '.join(f'{key}={quoteattr(value)}' for key, value in values.items())}>{name}</{tag}>"
    errors = schema.iter_errors(mission(text) if tag in OF_WORLD else mission(inside=text))
    assert not [error.reason for error in errors]


@pytest.mark.parametrize(
    ("world", "inside"),
    [
        ("", "<heading>${course=90}</heading> <count> ${n} </count> <x>1${zeros=00}</x>"),
        (
            '<run dt="${dt=0.1}" update="${order=sequential}"/> <end_condition>${ends=time}</end_condition>',
            "",
        ),
        ("", '<autonomy max_speed="${speed}" name="${name=a}">${who=Boids}</autonomy>'),
        ("", '<autonomy restlessness="2" mood="wild"> Wander </autonomy>'),
        (
            "",
            "<x>-2.5e3 m</x> <y>1 km</y> <z>30 ft</z> <vx>10 m/s</vx> <vy>5 kt</vy> <heading>0.5 rev</heading>",
        ),
        ("", "<generate_rate>1 / 2</generate_rate> <use_variance_all_ents> TRUE </use_variance_all_ents>"),
        ("<end_condition>time, one_team</end_condition> <!-- a comment -->", ""),
        ('<xi:include xmlns:xi="http://www.w3.org/2001/XInclude" href="part.xml"/>', ""),
        ('<param_common name="p"><max_speed>3</max_speed></param_common><entity_common name="e"/>', ""),
        ('<seed reseed_time="3">1</seed> <camera mode="follow" pos="0, 1, 2"/>', ""),
    ],
)
def test_what_is_allowed_is_valid(schema, world, inside):
    assert not [error.reason for error in schema.iter_errors(mission(world, inside))]


@pytest.mark.parametrize(
    ("world", "inside"),
    [
        ("<end_conditoin>time</end_conditoin>", ""),
        ("<end_condition>tiem</end_condition>", ""),
        ('<run dtt="0.1"/>', ""),
        ('<run update="simultaneous"/>', ""),
        ("", "<heding>90</heding>"),
        ("", "<heading>90 m</heading>"),
        ("", "<heading>north</heading>"),
        ("", "<heading>$course</heading>"),
        ("", "<radius>-1</radius>"),
        ("", "<autonomy>Boid</autonomy>"),
        ("", '<autonomy max_sped="30">Boids</autonomy>'),
        ("", '<autonomy max_speed="30 kts">Boids</autonomy>'),
        ("", '<autonomy mood="sad">Wander</autonomy>'),
        ("", '<autonomy restlessness="-1">Wander</autonomy>'),
        ("", "<motion_model>Boids</motion_model>"),
        ("", "<autonomy>Unicycle</autonomy>"),
        ("<metrics>SimpleCapture</metrics>", ""),
        ("", "<use_variance_all_ents>maybe</use_variance_all_ents>"),
    ],
)
def test_what_is_misspelt_is_not(schema, world, inside):
    assert schema.is_valid(mission())
    assert not schema.is_valid(mission(world, inside))


NUMBERS = (
    "1", "-1", "+1", ".5", "5.", "1e3", "1e-3", "1e1000", "inf", "-inf", "nan", "", "x", "1 2", "1,2", "12 m", "12m", "12 km", "12 kg",
    "1 mm", "1 nmi", "1 nm", "12 m/s", "3 deg", "3deg", "0x10", "1_000", "½", "1 m m",
)  # fmt: skip


@pytest.mark.parametrize("tag", ["x", "heading", "vx", "mass", "health"])
@pytest.mark.parametrize("text", NUMBERS)
def test_a_number_that_is_read_is_valid(schema, tag, text, tmp_path):
    """And of those that are not read, all but finite bounds and dimensions of products are invalid."""
    path = tmp_path / "m.xml"
    path.write_text(mission(inside=f"<team_id>1</team_id><{tag}>{text}</{tag}>"), encoding="utf-8")
    try:
        read_mission(path)
        is_read = True
    except TussleError:
        is_read = False
    said = ("/", "^", " m m", "inf")
    is_valid = schema.is_valid(path.read_text(encoding="utf-8"))
    assert is_valid == is_read or (is_valid and any(part in text for part in said))


def test_editors_show_meaning_unit_and_default(schema):
    attribute = schema.types["autonomy"].attributes["restlessness"]
    assert str(attribute.annotation) == "Wander: Turns per second. Default 0.5 1/s (>= 0)."
    heading = schema.find("runscript/entity/heading")
    assert "[deg], default 0" in str(heading.annotation)
