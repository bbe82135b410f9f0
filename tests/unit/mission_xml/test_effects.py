"""Values set from outside that nothing reads are errors."""

from __future__ import annotations

import pytest

from tussle.errors import MissionError

PLUGINS = (
    "<autonomy>Boids</autonomy><controller>DirectController</controller><motion_model>Unicycle</motion_model>"
)


def mission(world: str = "", entity: str = "") -> str:
    return f"<runscript>{world}\n<entity>\n<name>a</name><team_id>1</team_id>{entity}{PLUGINS}</entity></runscript>"


USELESS = [
    mission(entity="<cuont>${v=2}</cuont>"),
    mission(entity="<count>1</count><count>${v=2}</count><count>3</count>"),
    mission(entity="<count>3<max>${v=2}</max></count>"),
    mission(entity="${v=2}"),
    mission(entity="<id>${v=2}</id>"),
    mission(entity="<generate_start_time>${v=2}</generate_start_time>"),
    mission(entity="<latitude>${v=2}</latitude>"),
    mission(entity="<autonomy order='${v=2}'>Boids</autonomy>"),
    mission(entity="<autonomy max_sped='${v=2}'>Boids</autonomy>"),
    mission(entity="<autonomy>Boids<max_speed>${v=2}</max_speed></autonomy>"),
    mission("<param_common name='c'><max_speed>${v=2}</max_speed></param_common>"),
    mission("<entity_common name='c'><count>${v=2}</count></entity_common>"),
    mission("<run dt='${v=2}'/><run dt='0.1'/>"),
    mission("<run><dt>${v=2}</dt></run>"),
    mission("<oops a='${v=2}'/>"),
    mission("<?note ${v=2}?>"),
]


@pytest.mark.parametrize("text", USELESS)
@pytest.mark.parametrize("value", ["2", "7", "x"])
def test_a_placeholder_that_reaches_nothing_cannot_be_set(files, text, value):
    line = 1 if "${v=2}" in text.splitlines()[0] else 3
    assert files.read(text, strict=False).placeholders == {"v": "2"}
    with pytest.raises(
        MissionError, match=rf"v has no effect on anything: \${{v}} stands in .*m\.xml:{line}"
    ):
        files.read(text, {"v": value}, strict=False)
    assert files.read(text, {"v": value}, strict=False, checks_effects=False).settings == {"v": value}


@pytest.mark.parametrize(
    "text",
    [
        mission(entity="<count>${v=2}</count>"),
        mission(entity="<cuont>${v=2}</cuont><count>${v=2}</count>"),
        mission(entity="<visual_model>${v=2}</visual_model>"),
        mission(entity="<autonomy name='${v=2}'>Boids</autonomy>"),
        mission("<seed>${v=2}</seed>"),
        mission("<time_warp>${v=2}</time_warp><run time_warp='${v=2}'/>"),
        mission("<param_common name='c'><max_speed>${v=2}</max_speed></param_common>", "<autonomy param_common='c'>Boids</autonomy>"),
        mission("<run ${v=end}='2'/>"),
    ],
)  # fmt: skip
def test_a_placeholder_that_reaches_something_can_be_set_also_to_its_default(files, text):
    value = files.read(text, strict=False).placeholders["v"]
    files.read(text, {"v": value}, strict=False)


def test_the_message_names_the_right_tag(files):
    with pytest.raises(
        MissionError, match=r"m\.xml:3: tag in <entity> 'cuont' is unknown \(did you mean 'count'\?\)"
    ):
        files.read(mission(entity="<cuont>${v=2}</cuont>"), {"v": 3}, strict=False)


def test_all_that_have_no_effect_are_named(files):
    text = mission("<oops a='${v=2}' b='${w=2}'/>", "<count>${n=2}</count>")
    with pytest.raises(MissionError) as error:
        files.read(text, {"v": 3, "w": 3, "n": 4}, strict=False)
    assert [line.split()[0] for line in str(error.value).splitlines()] == ["v", "w"]


def test_a_path_to_what_is_ignored_is_an_error(files):
    with pytest.raises(MissionError, match=r"a\.latitude has no effect on anything in this mission"):
        files.read(mission(), {"a.latitude": 3})
    assert files.read(mission(), {"a.latitude": 0.5, "a.longitude": 0.5, "a.altitude": 3}).mission
