"""Which missions may hold unknown names: those of SCRIMMAGE, and what the user reads leniently."""

from __future__ import annotations

import re

import pytest

from tussle.errors import MissionError
from tussle.mission import read_mission, shipped_missions
from tussle.plugins import stock

PLUGINS = (
    "<autonomy>Boids</autonomy><controller>DirectController</controller><motion_model>Unicycle</motion_model>"
)
STYLE = '<?xml version="1.0"?>\n<?xml-stylesheet type="text/xsl" href="http://gtri.gatech.edu"?>\n'


def mission(world: str = "", entity: str = "", root: str = "", plugins: str = PLUGINS) -> str:
    return f"<runscript name='t' {root}>{world}\n<entity><team_id>1</team_id>{entity}{plugins}</entity>\n</runscript>"


MISSPELT = [
    (mission(root="compatt='x'"), "attribute of <runscript> 'compatt' is unknown (did you mean 'compat'?)"),
    (mission("<runn/>"), "tag 'runn' is unknown (did you mean 'run'?)"),
    (mission("<run edn='3'/>"), "attribute of <run> 'edn' is unknown (did you mean 'end'?)"),
    (mission("<run><dt>0.1</dt></run>"), "tag in <run> 'dt' is unknown"),
    (mission("<seed vale='3'>1</seed>"), "attribute of <seed> 'vale' is unknown"),
    (mission("<seed><n>1</n></seed>"), "tag in <seed> 'n' is unknown"),
    (mission("<end_condition time='3'/>"), "attribute of <end_condition> 'time' is unknown"),
    (mission("<camera mdoe='free'/>"), "attribute of <camera> 'mdoe' is unknown (did you mean 'mode'?)"),
    (mission("<grid_size unit='m'>9</grid_size>"), "attribute of <grid_size> 'unit' is unknown"),
    (mission("<ground>3<height>3</height></ground>"), "tag in <ground> 'height' is unknown"),
    (mission("<wall centre='0 0 0' center='0 0 0' lengths='1 1 1'/>"), "'centre' is unknown (did you mean 'center'?)"),
    (mission("<entity_interaction capture_rnge='3'>SimpleCapture</entity_interaction>"), "(did you mean 'capture_range'?)"),
    (mission(entity="<cuont>20</cuont>"), "tag in <entity> 'cuont' is unknown (did you mean 'count'?)"),
    (mission(entity="<count unit='1'>20</count>"), "attribute of <count> 'unit' is unknown"),
    (mission(entity="<count>20<max>30</max></count>"), "tag in <count> 'max' is unknown"),
    (mission(entity="<base><radios>3</radios></base>"), "tag in <base> 'radios' is unknown (did you mean 'radius'?)"),
    (mission(entity="<base radius='3'/>"), "attribute of <base> 'radius' is unknown"),
    (mission(entity="<base><radius unit='m'>3</radius></base>"), "attribute of <radius> 'unit' is unknown"),
    (mission(plugins=PLUGINS.replace("<autonomy", "<autonmy").replace("</autonomy", "</autonmy")), "(did you mean 'autonomy'?)"),
    (mission(plugins=PLUGINS.replace("<autonomy", "<autonomy max_sped='3'")), "(did you mean 'max_speed'?)"),
    (mission(plugins=PLUGINS.replace("Boids<", "Boids<max_speed>3</max_speed><")), "tag in <autonomy> 'max_speed' is unknown"),
    (mission(plugins="""<autonomy behaviors="[ MoveToGoalMS gaol='1,2,3' ]">MotorSchemas</autonomy>"""), "(did you mean 'goal'?)"),
    (
        mission("<param_common name='c'><max_sped>3</max_sped></param_common>", plugins="<autonomy param_common='c'>Boids</autonomy>"),
        "attribute of Boids 'max_sped' is unknown (did you mean 'max_speed'?)",
    ),
    (
        mission("<param_common name='c' nmae='d'><max_speed unit='kt'>3</max_speed></param_common>"),
        "attribute of <param_common> 'nmae' is unknown (did you mean 'name'?)",
    ),
    (mission("<param_common name='c'><max_speed unit='kt'>3</max_speed></param_common>"), "attribute of <max_speed> 'unit'"),
    (mission("<param_common name='c'><max_speed><kt>3</kt></max_speed></param_common>"), "tag in <max_speed> 'kt'"),
    (mission("<entity_common name='c'><cuont>3</cuont></entity_common>"), "tag in <entity_common> 'cuont' is unknown"),
    (mission("<entity_common name='c' id='3'/>"), "attribute of <entity_common> 'id' is unknown"),
    (
        mission("<entity_common name='c'><cuont>3</cuont></entity_common><entity entity_common='c'/>"),
        "tag in <entity> 'cuont' is unknown (did you mean 'count'?)",
    ),
]  # fmt: skip


@pytest.mark.parametrize(("text", "said"), MISSPELT, ids=[said for _, said in MISSPELT])
def test_unknown_names_are_errors_at_every_level_except_in_missions_of_scrimmage(files, text, said):
    with pytest.raises(MissionError) as error:
        files.read(text)
    assert said in str(error.value)
    assert re.search(r"m\.xml:1: unknown .* are errors, .*--lenient \(strict=False\)", str(error.value))
    lenient = files.read(text, strict=False)
    assert any(said.split(";")[0] in note and note.endswith("; it is ignored") for note in lenient.notes)
    assert not any("marks a mission" in note for note in lenient.notes), "the user has chosen it"
    old = files.read(STYLE + text)
    assert old.mission == lenient.mission
    assert any("its style sheet marks a mission of SCRIMMAGE; --strict" in note for note in old.notes)
    with pytest.raises(MissionError, match="is unknown"):
        files.read(STYLE + text, strict=True)


@pytest.mark.parametrize(
    ("marked", "mark"),
    [
        (mission("<oops/><stream_port>50051</stream_port>"), "<stream_port>"),
        (mission("<oops/><log_dir>~/x</log_dir>"), "<log_dir>"),
        (mission("<oops/><multi_threaded num_threads='8'>false</multi_threaded>"), "<multi_threaded>"),
        (mission("<oops/>", root="compat='scrimmage'"), "compat='scrimmage'"),
    ],
)
def test_marks_of_scrimmage(files, marked, mark):
    notes = files.read(marked).notes
    assert any(f"since {mark} marks a mission of SCRIMMAGE" in note for note in notes)
    assert not any("marks a mission" in n for n in files.read(marked.replace("<oops/>", "")).notes)


def test_the_option_compat_marks_too(files):
    text = mission("<oops/>")
    assert files.read(text, compat="scrimmage").notes
    with pytest.raises(MissionError, match="'oops' is unknown"):
        files.read(text, compat="")


@pytest.mark.parametrize(
    "text",
    [
        mission(
            "<oops/><grid_size>9</grid_size><background_color>1 2 3</background_color><time_warp>1</time_warp>"
        ),
        '<?xml-stylesheet href="mine.xsl"?>\n' + mission("<oops/>"),
        mission("<oops/>", root="xmlns:xsi='http://www.w3.org/2001/XMLSchema-instance'"),
    ],
    ids=["viewer", "style", "namespace"],
)
def test_what_missions_of_tussle_have_is_no_mark(files, text):
    with pytest.raises(MissionError, match="'oops' is unknown"):
        files.read(text)


def test_marks_of_included_files_count(files):
    files.write("<sim><log_dir>x</log_dir><oops/></sim>", "sim.xml")
    include = (
        '<xi:include xmlns:xi="http://www.w3.org/2001/XInclude" href="sim.xml" xpointer="xpointer(/sim/*)"/>'
    )
    assert any("sim.xml:1: tag 'oops' is unknown" in note for note in files.read(mission(include)).notes)


def test_a_shared_parameter_may_be_meant_for_one_of_the_plugins_that_take_it(files):
    plugins = (
        "<autonomy param_common='c'>Boids</autonomy><motion_model param_common='c'>Unicycle</motion_model>"
    )
    text = mission(
        "<param_common name='c'><max_speed>3</max_speed><vel_max>4</vel_max>\n<oops>1</oops></param_common>",
        plugins=plugins,
    )
    with pytest.raises(MissionError, match=r"m\.xml:2: attribute of \w+ 'oops' is unknown") as error:
        files.read(text)
    assert len(str(error.value).splitlines()) == 2
    assert files.read(text.replace("<oops>1</oops>", "")).mission.blocks[0].motion.values["vel_max"] == 4.0


def test_an_entity_common_that_nothing_takes_is_noted(files):
    notes = files.read(mission("<entity_common name='c'><count>3</count></entity_common>")).notes
    assert any("m.xml:1: no entity takes this <entity_common>; it is ignored" in note for note in notes)


@pytest.mark.parametrize("name", [*shipped_missions(), *stock.examples()])
def test_missions_that_ship_have_only_known_names(name):
    read_mission(name, strict=True)
