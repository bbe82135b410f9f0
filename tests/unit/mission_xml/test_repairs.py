"""Malformed missions that SCRIMMAGE reads: a note in the lenient reading, an error with the repaired text in the strict one."""

from __future__ import annotations

import pytest

from tussle.errors import MissionError
from tussle.mission.node import repair

MALFORMED = {
    "comment": ("<!-- run it --seed 3 -->", '"--" is inside a comment', "<!-- run it - -seed 3 -->"),
    "comment that ends with dashes": ("<!-- x --->", '"--" is inside a comment', "<!-- x - -->"),
    "closing tag": ("<run end='1'></rum>", "<run> is closed by </rum>", "<run end='1'></run>"),
    "ampersand": ("<metrics name='a & b'>CPA</metrics>", "& is not written &amp;", "<metrics name='a &amp; b'>CPA</metrics>"),
    "ampersand in a value": ("<run end='1' dt='1' name='&x;'/>", "& is not", "<run end='1' dt='1' name='&amp;x;'/>"),
}  # fmt: skip


@pytest.mark.parametrize("kind", MALFORMED)
def test_malformed_xml_is_read_as_scrimmage_does_or_shown_repaired(files, kind):
    tag, why, repaired = MALFORMED[kind]
    text = f"\n\n{tag}"
    loaded = files.world(text, strict=False)
    (note,) = (n for n in loaded.notes if why in n)
    assert f"m.xml:4: this is not well-formed XML: {why}" in note
    assert "it is read as" in note
    assert repaired in note
    with pytest.raises(MissionError) as error:
        files.world(text)
    assert f"m.xml:4: this is not well-formed XML: {why}" in str(error.value)
    assert "write" in str(error.value)
    assert repaired in str(error.value)
    assert "--lenient" in str(error.value)


def test_the_text_that_is_kept_is_well_formed(files):
    tag, _, repaired = MALFORMED["comment"]
    loaded = files.world(tag, strict=False)
    assert repaired in loaded.text
    assert files.read(loaded.text).mission == loaded.mission


@pytest.mark.parametrize(
    "text",
    [
        "<runscript><entity></runscript>",
        "<runscript><run end='1/></runscript>",
        "<runscript><!-- -- </runscript>",
        "<runscript><![CDATA[ & </runscript>",
        "<runscript>& <</runscript>",
    ],
)
def test_what_scrimmage_cannot_read_either_is_an_error(files, text):
    with pytest.raises(MissionError, match="not well-formed XML"):
        files.read(text, strict=False)


def test_lines_stay_where_they_are():
    text = "<a>\n<b\n x='&'>\n<!-- --\n-- --><![CDATA[ & ]]>\n</c\n>\n & </a>"
    repaired, changes = repair(text)
    assert repaired.count("\n") == text.count("\n")
    assert [(change.line, change.repaired) for change in changes] == [
        (3, "x='&amp;'>"), (4, "<!-- - -"), (6, "</b"), (8, "&amp; </a>"),
    ]  # fmt: skip


def test_mending_takes_linear_time():
    for part in ("<a ", "<a '", "<!--", "</a ", "&", "<a b='", "<?x"):
        repair(part * 200_000)


@pytest.mark.parametrize(("text", "whole"), [("12.5", 12), ("1.999", 1), ("3.0", 3)])
def test_a_motion_multiplier_with_a_fraction_is_cut(files, text, whole):
    tag = f"<run dt='1' motion_multiplier='{text}'/>"
    loaded = files.world(tag, strict=False)
    assert loaded.mission.motion_multiplier == whole
    if float(text) != whole:
        assert any(f"it is read as 'motion_multiplier=\"{whole}\"'" in note for note in loaded.notes)
        with pytest.raises(
            MissionError, match=f"is not a whole number; write 'motion_multiplier=\"{whole}\"'"
        ):
            files.world(tag)


@pytest.mark.parametrize("text", ["0.5", "-1.5", "nan", "1e9"])
def test_other_motion_multipliers_stay_errors(files, text):
    with pytest.raises(MissionError, match="motion_multiplier"):
        files.world(f"<run motion_multiplier='{text}'/>", strict=False)


SCHEMAS = '<autonomy behaviors="{}">MotorSchemas</autonomy><motion_model>SingleIntegrator</motion_model>'


@pytest.mark.parametrize(
    ("written", "repaired"),
    [
        ("[ MoveToGoalMS use_initial_heading='true goal='1,2,3']", "use_initial_heading='true' goal='1,2,3'"),
        ("[MoveToGoalMS gain=2' goal='1,2,3 ]", "gain='2' goal='1,2,3'"),
    ],
)
def test_quotes_that_do_not_match_are_dropped(files, written, repaired):
    inside = f"<entity>{SCHEMAS.format(written)}</entity>"
    text = f"<runscript>\n{inside}\n</runscript>"
    loaded = files.read(text, strict=False)
    (behavior,) = loaded.mission.blocks[0].autonomy[0].values["behaviors"]
    assert tuple(behavior.values["goal"]) == (1.0, 2.0, 3.0)
    assert any(f'it is read as "[ MoveToGoalMS {repaired} ]"' in note for note in loaded.notes)
    with pytest.raises(MissionError, match=r"m\.xml:2: .*; write ") as error:
        files.read(text)
    assert repaired in str(error.value)


@pytest.mark.parametrize("written", ["[ MoveToGoalMS 'x ]", "[ MoveToGoalMS goal='1,2,3", "[ ] x'"])
def test_other_faults_of_behaviors_stay_errors(files, written):
    with pytest.raises(MissionError, match="is not"):
        files.read(f"<runscript><entity>{SCHEMAS.format(written)}</entity></runscript>", strict=False)


def test_more_slots_than_entities_and_a_far_end_are_no_errors(files):
    loaded = files.world(
        "<run end='1e7' dt='0.001'/>",
        "<count>6</count><generate_rate>1/2</generate_rate><generate_count>999999</generate_count>",
    )
    assert loaded.mission.steps == 10**10
    assert loaded.mission.blocks[0].slots == 6


def test_a_game_with_a_far_end_begins(files):
    from tussle import Simulation

    mission = files.world("<run end='1e7' dt='0.001'/>").mission
    with Simulation(mission, 1) as sim:
        sim.step()
        assert sim.t[0] == pytest.approx(0.001)
