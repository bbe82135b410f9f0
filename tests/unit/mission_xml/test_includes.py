"""Files that a mission includes: relative, below its folder or the search paths, bounded, and never twice inside themselves."""

from __future__ import annotations

import pytest

from tussle.errors import MissionError
from tussle.mission import read_mission

XI = 'xmlns:xi="http://www.w3.org/2001/XInclude"'
ENTITY = "<entity><name>a</name><count>${n=1}</count></entity>"


def main(*includes: str) -> str:
    return f"<runscript {XI}>\n" + "\n".join(includes) + "\n</runscript>"


def test_files_are_included_with_their_own_lines_and_placeholders(files):
    files.write(ENTITY.replace("</entity>", "\n<oops/></entity>"), "parts/e.xml")
    files.write("<sim><run end='3'/>\n<seed>4</seed></sim>", "parts/sim.xml")
    loaded = files.read(
        main(
            '<xi:include href="parts/e.xml"/>',
            '<xi:include href="sim.xml" xml:base="parts/" xpointer="xpointer(/sim/*)"/>',
        ),
        {"n": "6"},
        strict=False,
    )
    assert (loaded.mission.end, loaded.seed, loaded.mission.blocks[0].count) == (3.0, 4, 6)
    assert "e.xml:2: tag in <entity> 'oops' is unknown" in "\n".join(loaded.notes)
    assert files.read(loaded.text, strict=False).mission == loaded.mission


def test_included_files_include(files):
    files.write(f'<x {XI}><xi:include href="../e.xml"/></x>', "deep/x.xml")
    files.write(ENTITY, "e.xml")
    assert (
        files.read(main('<xi:include href="deep/x.xml" xpointer="xpointer(/x/entity)"/>'))
        .mission.blocks[0]
        .name
        == "a"
    )


def test_a_pointer_that_selects_nothing_is_said(files):
    files.write(ENTITY, "e.xml")
    loaded = files.read(
        main('<xi:include href="e.xml"/>', '<xi:include href="e.xml" xpointer="xpointer(/entity/nothing)"/>')
    )
    assert "selects nothing" in "\n".join(loaded.notes)


@pytest.mark.parametrize(
    ("include", "said"),
    [
        (
            '<xi:include href="../out.xml"/>',
            r"m\.xml:2: '\.\./out\.xml' lies outside the mission's folder and the search paths",
        ),
        ('<xi:include href="link.xml"/>', "'link.xml' lies outside"),
        ('<xi:include href="/etc/passwd"/>', "'/etc/passwd' cannot be included; it takes a path relative"),
        ('<xi:include href="file:///etc/passwd"/>', "cannot be included"),
        ('<xi:include href="http://example.org/x.xml"/>', "cannot be included"),
        ('<xi:include href="e.xml" xml:base="http://example.org/"/>', "cannot be included"),
        ('<xi:include href="~/x.xml"/>', "cannot be included"),
        ('<xi:include href="a\\b.xml"/>', "cannot be included"),
        ('<xi:include href=""/>', "needs href"),
        ("<xi:include/>", "needs href"),
        ('<xi:include href="missing.xml"/>', "there is no file 'missing.xml' to include"),
        ('<xi:include href="."/>', "there is no file"),
        (f'<xi:include href="{"x" * 5000}"/>', "there is no file"),
        ('<xi:include href="e.xml" parse="text"/>', "of XInclude, only"),
        ('<xi:include href="e.xml"><xi:fallback/></xi:include>', "of XInclude, only"),
        ('<xi:fallback href="e.xml"/>', "of XInclude, only"),
        ('<xi:include href="e.xml" accept="text/xml"/>', "include takes href and xpointer, not 'accept'"),
        ('<xi:include href="e.xml" xpointer="element(/1)"/>', "is not supported; it takes xpointer"),
        ('<xi:include href="m.xml"/>', r"m\.xml:2: a file includes itself: m\.xml -> m\.xml"),
        ('<xi:include href="loop1.xml"/>', r"loop2\.xml:1: a file includes itself"),
        ('<xi:include href="bad.xml"/>', r"bad\.xml:1: this is not well-formed XML"),
        ('<xi:include href="doctype.xml"/>', r"doctype\.xml:1: a DOCTYPE is not allowed"),
        ("\n".join(['<xi:include href="e.xml"/>'] * 70), "more than 64 files are included"),
        ('<xi:include href="d0.xml"/>', "nested more than 8 deep"),
    ],
)
def test_what_is_refused(files, include, said):
    folder = files.folder
    files.folder = folder / "mission"
    files.write(ENTITY, "../out.xml")
    files.write(ENTITY, "e.xml")
    files.write(f'<x {XI}><xi:include href="loop2.xml"/></x>', "loop1.xml")
    files.write(f'<x {XI}><xi:include href="loop1.xml"/></x>', "loop2.xml")
    files.write("<a><b></a>", "bad.xml")
    files.write("<!DOCTYPE x [<!ENTITY a 'b'>]><x/>", "doctype.xml")
    for i in range(12):
        files.write(f'<x {XI}><xi:include href="d{i + 1}.xml"/></x>', f"d{i}.xml")
    (files.folder / "link.xml").symlink_to(folder / "out.xml")
    with pytest.raises(MissionError, match=said):
        files.read(main(include))


def test_search_paths_open_their_folder(files):
    folder = files.folder
    files.folder = folder / "mission"
    files.write(ENTITY, "../other/e.xml")
    text = main('<xi:include href="../other/e.xml"/>')
    with pytest.raises(MissionError, match="outside"):
        files.read(text)
    assert files.read(text, search=[folder / "other"]).mission.blocks[0].name == "a"
    assert (
        files.read(main('<xi:include href="e.xml"/>'), search=[folder / "other"]).mission.blocks[0].name
        == "a"
    )


def test_the_existing_system_s_example(existing):
    path = existing("straight_include/straight_include.xml")
    with pytest.raises(MissionError, match=r"straight_include\.xml:13: '\.\./straight\.xml' lies outside"):
        read_mission(path)
    loaded = read_mission(path, search=[path.parent.parent])
    assert (
        loaded.mission.interactions == read_mission(path.parent.parent / "straight.xml").mission.interactions
    )
    assert [b.count for b in loaded.mission.blocks] == [1, 30]
