"""Broken and hostile missions: each ends within seconds in one message with its place, a non-zero exit code, and nothing written."""

from __future__ import annotations

import os

import pytest

RUN = '<run start="0" end="5" dt="0.1"/>'
ENTITY = (
    "<entity><team_id>1</team_id><autonomy>Boids</autonomy><motion_model>Unicycle</motion_model></entity>"
)


def mission(inside, head=""):
    return f"{head}<runscript>\n{inside}\n</runscript>\n"


def with_entity(tags, run=RUN):
    return mission(f"{run}\n<entity><team_id>1</team_id>\n{tags}</entity>")


BILLION_LAUGHS = "<!DOCTYPE x [" + '<!ENTITY a0 "ha">' + "".join(
    f'<!ENTITY a{i} "{f"&a{i - 1};" * 10}">' for i in range(1, 10)
) + "]>"  # fmt: skip

CASES = {
    "malformed": (mission(f"{RUN}<a b=1/>"), "bad.xml:2"),
    "entity_bomb": (mission(f"{RUN}<seed>&a9;</seed>", BILLION_LAUGHS + "\n"), "bad.xml:1"),
    "path_outside": (
        mission(f'{RUN}<xi:include xmlns:xi="http://www.w3.org/2001/XInclude" href="../../../../etc/passwd"/>'),
        "bad.xml:2",
    ),
    "a_billion_robots": (with_entity("<count>1000000000</count><motion_model>Unicycle</motion_model>"), "bad.xml:4"),
    "unknown_plugin": (with_entity("<motion_model>Unicyle</motion_model>"), "did you mean 'Unicycle'?"),
    "nobody_writes": (with_entity("<motion_model>Unicycle</motion_model>"), "bad.xml:3: block"),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_it_ends_soon_in_one_message_and_writes_nothing(tussle, folder, name):
    text, expected = CASES[name]
    (folder / "bad.xml").write_text(text)
    done = tussle("run", "bad.xml", code=1)
    errors = [line for line in done.stderr.splitlines() if line.startswith("error: ")]
    assert len(errors) == 1
    assert expected in errors[0]
    assert len(errors[0]) < 2000
    assert all(line.startswith(("error: ", "note: ")) for line in done.stderr.splitlines())
    assert "root:" not in done.stderr
    assert not done.stdout
    assert {p.name for p in folder.iterdir()} == {"bad.xml", "game.xml"}


def test_of_a_tag_that_is_not_closed_both_the_place_and_the_end_are_told(tussle, folder):
    (folder / "bad.xml").write_text(mission(f"{RUN}<entity>"))
    done = tussle("run", "bad.xml", code=1)
    errors = [line for line in done.stderr.splitlines() if line.startswith("error: ")]
    assert [line.split(": ")[1] for line in errors] == ["bad.xml:3", "bad.xml:4"]


def test_all_that_is_wrong_is_told_at_once_with_a_line_each(tussle, folder):
    tags = '<count>x</count>\n<autonomy max_speed="3 kg">Boids</autonomy>\n<motion_model>Unicyle</motion_model>\n'
    (folder / "bad.xml").write_text(with_entity(tags))
    done = tussle("check", "bad.xml", code=1)
    assert [line.split(": ")[1] for line in done.stderr.splitlines()] == [
        "bad.xml:4",
        "bad.xml:5",
        "bad.xml:6",
    ]


PLUGIN_FILES = {
    "syntax": ("def f(:\n", "own.py:1"),
    "raises": ("\n1 / 0\n", "own.py:2"),
    "leaves": ("import sys\nsys.exit(0)\n", "own.py:2"),
    "imports_nothing_there": ("import no_such_module\n", "own.py:1"),
    "no_plugin": ("x = 1\n", "own.py: it defines no plugin"),
}


@pytest.mark.parametrize("name", PLUGIN_FILES)
def test_a_plugin_file_that_cannot_be_imported_is_told_with_its_line(tussle, folder, name):
    text, expected = PLUGIN_FILES[name]
    (folder / "own.py").write_text(text)
    done = tussle("run", "game.xml", "--plugin-path", "own.py", code=1)
    (line,) = done.stderr.splitlines()
    assert expected in line


def test_what_is_no_file_is_not_waited_for(tussle, folder):
    os.mkfifo(folder / "pipe.xml")
    for name in ("pipe.xml", "/dev/zero", "."):
        assert tussle("run", name, code=1).stderr.startswith("error: ")


def test_a_title_that_is_a_path_does_not_lead_out_of_the_folder(tussle, folder):
    text = (folder / "game.xml").read_text().replace("A small game", "../../[red]outside[/red]")
    (folder / "inside").mkdir()
    (folder / "inside" / "..odd name;.xml").write_text(text)
    done = tussle("run", "inside/..odd name;.xml", "--end", "0.3")
    assert " ../../[red]outside[/red]" in done.stdout.splitlines()
    (run,) = (folder / "runs").iterdir()
    assert run.name.startswith("odd_name-7-")
    assert {p.name for p in folder.iterdir()} == {"inside", "game.xml", "runs"}
