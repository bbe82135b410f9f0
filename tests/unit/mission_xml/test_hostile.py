"""Files that want too much, or are no missions: one message each, soon, and nothing is read that may not be."""

from __future__ import annotations

import os
import time

import pytest

from tussle.errors import MissionError
from tussle.mission import Limits, read_mission

BOMB = (
    "<!DOCTYPE r [<!ENTITY a0 'ha'>"
    + "".join(f"<!ENTITY a{i} '{f'&a{i - 1};' * 10}'>" for i in range(1, 12))
    + "]><runscript>&a11;</runscript>"
)
SECONDS = 60.0
"""A bound for the slowest of these files on a busy machine; most take milliseconds."""


@pytest.fixture(autouse=True)
def soon():
    begin = time.process_time()
    yield
    assert time.process_time() - begin < SECONDS


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "not well-formed"),
        ("no xml at all", "not well-formed"),
        ("<runscript>", "not well-formed XML: no element found"),
        ("<runscript><entity></runscript>", "mismatched tag"),
        ("<runscript/><runscript/>", "junk after document element"),
        ("<runscript>\n\n&nope;</runscript>", r"m\.xml:3: this is not well-formed XML: & is not written &amp;"),
        ("<runscript a='1' a='2'/>", "duplicate attribute"),
        ("<x:runscript/>", "unbound prefix"),
        ("<runscript>\x00</runscript>", "not well-formed"),
        ("<mission/>", "the root tag is <mission>"),
        ("<runscript/>", "the mission has no <entity>"),
        (BOMB, r"m\.xml:1: a DOCTYPE is not allowed"),
        ("<!DOCTYPE r SYSTEM 'http://example.org/x.dtd'><runscript/>", "a DOCTYPE is not allowed"),
        ("<!DOCTYPE r [<!ENTITY x SYSTEM 'file:///etc/passwd'>]><runscript>&x;</runscript>", "a DOCTYPE is not allowed"),
        ("<!DOCTYPE r><runscript/>", "a DOCTYPE is not allowed"),
        ("<a>" * 5000, "nested more than 32 deep"),
        ("<runscript>" + "<a/>" * 200_000 + "</runscript>", "more than 100,000 tags"),
        ("<runscript>" + " " * 5_000_000 + "</runscript>", "longer than 4,000,000 characters"),
        ("<runscript>" + "<entity/>" * 6000 + "</runscript>", "more than 5,000 <entity>"),
        ("<runscript>" + "<metrics/>" * 1001 + "<entity/></runscript>", "more than 1,000 plugins in <runscript>"),
        ("<runscript>" + "<!--" * 500_000 + "</runscript>", "not well-formed"),
        ("${" * 500_000, "not well-formed"),
        ("<runscript " + " ".join(f"a{i}='1'" for i in range(50_000)) + "/>", "reading stopped here"),
        ("<runscript>" + "".join(f"<u{i}/>" for i in range(50_000)) + "</runscript>", "has no <entity>"),
        ("<runscript>" + "".join(f"<metrics>P{i}</metrics>" for i in range(900)) + "<entity/></runscript>", "reading stopped here"),
    ],
    ids=lambda text: text[:30],
)  # fmt: skip
def test_no_missions(files, text, said):
    with pytest.raises(MissionError, match=said):
        files.read(text)


@pytest.mark.parametrize(
    ("tags", "inside", "said"),
    [
        ("", "<count>1000000000</count>", r"count: .* 1,000,000,000 entities .* 200,000"),
        ("", "<count>1e300</count>", "count: '1e300' is not allowed"),
        ("", "<count>-1</count>", "count: '-1' is not allowed"),
        ("", "<count>1.5</count>", "count: '1.5' is not allowed"),
        ("", "<team_id>99999999999</team_id>", "team_id"),
        ("", "<x>1e999</x>", "x: "),
        ("", "<x>nan</x>", "x: 'nan' is not a number"),
        ("", "<x>inf</x>", "takes a finite number"),
        ("", f"<x>{'9' * 100_000}</x>", "is not a number"),
        ("", "<health>0</health>", "health: '0' is not allowed; it takes a number > 0"),
        ("", "<variance_x>-1</variance_x>", "variance_x: '-1' is not allowed; it takes a number >= 0"),
        ("", "<heading>90 m</heading>", "heading: '90 m' is in m, not convertible to rad"),
        ("", "<latitude>95</latitude><longitude>0</longitude><altitude>0</altitude>", "latitude: 95 deg is not allowed"),
        ("", "<latitude>x</latitude><longitude>0</longitude><altitude>0</altitude>", "latitude: 'x' is not a number"),
        ("", "<placement>square</placement>", "placement: 'square' is not allowed; it takes one of 'normal', 'uniform'"),
        ("", "<generate_rate>1/0</generate_rate>", "it divides by zero"),
        ("", "<base><radius>-1</radius></base>", "radius: '-1' is not allowed"),
        ("", "<base><opacity>2</opacity></base>", "opacity"),
        ("", "<autonomy/>", "<autonomy> is empty"),
        ("", f"<autonomy>{'x' * 10_000}</autonomy>", "there is no plugin"),
        ("", "<autonomy loop_rate='-1'>Boids</autonomy>", "loop_rate = -1.0 is not allowed"),
        ("", "<autonomy loop_rate='inf'>Boids</autonomy>", "loop_rate"),
        ("", "<autonomy behaviors=\"[ NoSuch ]\">MotorSchemas</autonomy>", "behavior: there is no plugin 'NoSuch'"),
        ("", "<autonomy behaviors=\"[ ROSAirSim ]\">MotorSchemas</autonomy>", "behavior ROSAirSim is dropped: AirSim is no longer"),
        ("", "<autonomy behaviors=\"[ Boids ]\">MotorSchemas</autonomy>", "Boids is not allowed in behavior"),
        ("", f"<autonomy behaviors=\"{'[ AvoidEntityMS ]' * 5000}\">MotorSchemas</autonomy>", "more than 1,000 plugins"),
        ("", f"<autonomy behaviors=\"{'[' * 100_000}\">MotorSchemas</autonomy>", "is not a plugin"),
        ("", f"<autonomy goal=\"{'1 ' * 500_000}\">Boids</autonomy>", "has more than 100,000 numbers"),
        ("<latitude_origin>-95</latitude_origin>", "", "latitude_origin: -95 deg is not allowed; it takes degrees from -90 to 90"),
        ("<run dt='0'/>", "", "dt: '0' is not allowed; it takes a number > 0"),
        ("<run dt='-0.1'/>", "", "dt: '-0.1' is not allowed"),
        ("<run dt='nan'/>", "", "dt: 'nan' is not a number"),
        ("<run dt='1e-300'/>", "", "are more than 1,000,000,000,000,000 steps"),
        ("<run end='1e30'/>", "", "are more than 1,000,000,000,000,000 steps"),
        ("<run start='-1e30' end='1e30'/>", "", "are more than 1,000,000,000,000,000 steps"),
        ("<run motion_multiplier='0'/>", "", "motion_multiplier: '0' is not allowed"),
        ("<run motion_multiplier='1.5'/>", "", "motion_multiplier"),
        ("<run motion_multiplier='1000000000'/>", "", "motion_multiplier"),
        ("<run enable_gui='perhaps'/>", "", "enable_gui: 'perhaps' is not allowed; it takes true or false"),
        ("<run update='parallel'/>", "", "update: 'parallel' is not allowed"),
        ("<param_common/>", "", "param_common has no name"),
        ("<entity_common/>", "", "entity_common has no name"),
    ],
    ids=lambda text: text[:40],
)  # fmt: skip
def test_values_that_are_not_allowed(files, tags, inside, said):
    with pytest.raises(MissionError, match=rf"m\.xml:\d+: .*{said}"):
        files.world(tags, inside)


@pytest.mark.slow
def test_large_files_are_read_when_allowed(files):
    text = "<runscript>" + "<x/>" * 150_000 + "<entity><count>300000</count></entity></runscript>"
    with pytest.raises(MissionError, match="allow_large"):
        files.read(text)
    loaded = files.read(text, allow_large=True, strict=False)
    assert loaded.mission.blocks[0].count == 300_000
    assert len(loaded.notes) <= 102


TAKES = "<entity entity_common='c'/>" * 4000
NAMES, ATTRIBUTES = "<name/>" * 40_000, " ".join(f"a{i}='1'" for i in range(50_000))
LEARNS = "<entity>" + "<autonomy param_common='c'>Boids</autonomy>" * 900 + "</entity>"


def common(kind, inside):
    return f"<{kind}_common name='c'>{inside}</{kind}_common>"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (common("entity", "<base/>" * 1000) + TAKES, "100,000 tags"),
        (common("entity", NAMES) + f"<entity entity_common='c'>{NAMES}</entity>", "100,000 tags"),
        (common("entity", f"<x>{'1' * 1_000_000}</x>") + TAKES, "longer than 4,000,000"),
        (common("entity", f"<x {ATTRIBUTES}/>") + TAKES, "longer than 4,000,000"),
        (common("param", "".join(f"<u{i}/>" for i in range(1000))) + LEARNS, "100,000 tags"),
        (common("param", f"<goal>{'1 ' * 50_000}</goal>") + LEARNS, "longer than 4,000,000"),
        ("".join(f"<entity_common name='d{i}'/>" for i in range(20_000)) + TAKES, "there is no entity_common 'c'"),
    ],
    ids=["tags", "names", "text", "attributes", "parameters", "values", "guesses"],
)  # fmt: skip
def test_what_many_take_from_one_place_is_counted(files, text, said):
    with pytest.raises(MissionError, match=said):
        files.read(f"<runscript>{text}</runscript>")


def test_as_much_may_be_taken_as_may_be_written(files):
    shared = common("entity", "<team_id>3</team_id><motion_model>Still</motion_model>")
    loaded = files.read(f"<runscript>{shared}{TAKES}</runscript>")
    assert {b.team for b in loaded.mission.blocks} == {3}


def test_placeholders_without_a_value_are_told_soon_with_their_lines(files):
    with pytest.raises(MissionError, match=r"m\.xml:2, 3, 4, 5, 6, 7 \.\.\.: \$\{a\} has no default"):
        files.read("<runscript>\n" + "${a}\n" * 300_000 + "</runscript>")


def test_includes_cannot_grow_beyond_the_limit(files):
    files.write("<entity><name>${a=1}${a=1}${a=1}</name></entity>", "part.xml")
    text = (
        "<runscript xmlns:xi='http://www.w3.org/2001/XInclude'>"
        + "<xi:include href='part.xml'/>" * 9
        + "</runscript>"
    )
    with pytest.raises(MissionError, match="longer than 4,000,000 characters"):
        files.read(text, {"a": "x" * 300_000})


def test_update_sequential_bears_fewer_entities(files):
    said = r"20,000 entities .* with update='sequential' is 10,000; .*allow_large"
    for inside, settings in (("<run update='sequential'/>", {}), ("", {"run.update": "sequential"})):
        with pytest.raises(MissionError, match=said):
            files.world(inside, "<count>20000</count>", settings)
    loaded = files.world("<run update='sequential'/>", "<count>20000</count>", allow_large=True)
    assert loaded.mission.limits == Limits.large()
    assert files.world("", "<count>20000</count>").mission.limits == Limits()


def test_placeholders_cannot_grow_beyond_the_limit(files):
    with pytest.raises(MissionError, match="with its placeholders replaced"):
        files.read("<runscript>" + "${a=1}" * 100_000 + "</runscript>", {"a": "x" * 10_000})


def test_encodings(files):
    text = "<?xml version='1.0' encoding='{}'?><runscript name='é'><entity/></runscript>"
    for name in ("utf-8", "UTF-8", "iso-8859-1", "windows-1252"):
        path = files.write(text.format(name).encode(name))
        loaded = read_mission(path)
        assert loaded.name == "é"
        assert files.read(loaded.text).name == "é"
    assert read_mission(files.write(b"\xef\xbb\xbf" + text.format("utf-8").encode())).name == "é"
    with pytest.raises(MissionError, match=r"m\.xml:1: encoding 'utf-16' is not supported"):
        read_mission(files.write(text.format("utf-16").encode()))
    with pytest.raises(MissionError, match=r"m\.xml:2: byte 0xff is not utf-8 text"):
        read_mission(files.write(b"<runscript>\n\xff</runscript>"))
    for name in ("utf-16", "utf-32", "utf-16-be"):
        with pytest.raises(
            MissionError, match=r"m\.xml:1: this is UTF-16 or UTF-32 text; save the file as UTF-8"
        ):
            read_mission(files.write(("\ufeff" + text.format(name)).encode(name)))


def test_line_ends(files):
    with pytest.raises(MissionError, match=r"m\.xml:3: "):
        files.read("<runscript>\r\n<entity>\r\n<count>x</count></entity></runscript>")


@pytest.mark.parametrize(
    "name", ["nothing.xml", "", "x" * 5000, "a\0b", "~nobody-of-this-name/x", "predator_pray"]
)
def test_missions_that_are_not_there(name):
    with pytest.raises(
        MissionError, match=r"neither a file nor a shipped mission|is not a file name|is a folder"
    ):
        read_mission(name)


def test_what_is_no_file_is_not_opened(files, tmp_path):
    os.mkfifo(tmp_path / "pipe.xml")
    with pytest.raises(MissionError, match="is neither a file"):
        read_mission(tmp_path / "pipe.xml")
    with pytest.raises(MissionError, match="is a folder"):
        read_mission(tmp_path)
    path = files.write("<runscript/>")
    path.chmod(0)
    if not os.access(path, os.R_OK):
        with pytest.raises(MissionError, match="cannot be read"):
            read_mission(path)


def test_reading_writes_nothing(files, tmp_path):
    files.world("<log_dir>./logs</log_dir><output_type>all</output_type>")
    assert [p.name for p in tmp_path.iterdir()] == ["m.xml"]
