"""tussle plot: plots of a run, as a user asks for them."""

from __future__ import annotations

import shutil

import pytest


@pytest.fixture
def played(tussle, folder):
    """A short game."""
    tussle("run", "game.xml", "--out", "played")
    return folder / "played"


def test_the_plots_lie_in_the_run_and_their_paths_are_printed(tussle, played):
    said = tussle("plot", "played")
    paths = said.stdout.splitlines()
    assert paths[0] == "played/plots/trajectory.png"
    assert all((played.parent / path).stat().st_size > 5000 for path in paths)
    assert {"played/plots/left.png", "played/plots/density.png"} <= set(paths)


def test_what_is_asked_for_is_plotted_where_it_is_asked_for(tussle, played, folder):
    said = tussle(
        *("plot", "played", "--kind", "speed", "--kind", "trajectory3d", "--format", "svg", "--out", "here"),
        *("--team", "2", "--entity", "11", "--from", "1", "--to", "2 s"),
    )
    assert said.stdout.splitlines() == ["here/speed.svg", "here/trajectory3d.svg"]
    assert "11 (hunters)" in (folder / "here" / "speed.svg").read_text()
    assert not (played / "plots").exists()
    said = tussle("plot", "played", "--between", "1", "11")
    assert said.stdout == "played/plots/distance-1-11.png\n"


def test_what_it_cannot_do_is_told_in_one_line(tussle, played, folder):
    for arguments, code, words in (
        (("nowhere",), 4, "nowhere: it is not a run directory"),
        (("played", "--entity", "40"), 1, "played: there is no entity 40; there are 1 to 12"),
        (
            ("played", "--from", "1 h"),
            1,
            "played: nothing was recorded from 3600 s; there are states from 0 s to 3 s",
        ),
        (("played", "--from", "3 kg"), 1, "--from: "),
        (("played", "--kind", "hight"), 1, "there is no plot 'hight'"),
        (("played", "--world", "2"), 4, "there is no world 2"),
        (("played", "--between", "1"), 2, "--between"),
    ):
        said = tussle("plot", *arguments, code=code)
        assert words in said.stderr
        assert "Traceback" not in said.stderr
        assert code == 2 or len(said.stderr.splitlines()) == 1
    assert not (played / "plots").exists()
    said = tussle("plot", "played", "--column", "hight", "--column", "z", "--kind", "left", code=1)
    assert said.stdout.splitlines() == ["played/plots/z.png", "played/plots/left.png"]
    assert said.stderr.startswith("error: played: there is no column 'hight'")


def test_a_run_that_was_cut_is_plotted_and_it_is_said(tussle, played):
    (played / "run.json").unlink()
    said = tussle("plot", "played", "--kind", "left")
    assert "note: run.json is missing" in said.stderr
    assert said.stdout == "played/plots/left.png\n"


def test_a_run_with_a_plugin_of_ones_own_needs_no_path_unless_its_copy_is_lost(tussle, folder):
    (folder / "mine.py").write_text(
        'from tussle.stock import Predator\n\n\nclass Mine(Predator):\n    """Mine."""\n'
    )
    tussle(
        "run",
        "predator_prey",
        "--end",
        "1",
        "--plugin-path",
        "mine.py",
        "--set",
        "keepers.autonomy=Mine",
        "--out",
        "mine",
    )
    assert tussle("plot", "mine", "--out", "first").stderr == ""
    shutil.rmtree(folder / "mine" / "plugins")
    notes = tussle("plot", "mine").stderr.splitlines()
    assert len(notes) == 1
    assert "there is no plugin 'Mine'" in notes[0]
    assert len(notes[0]) < 300
    said = tussle("plot", "mine", "--plugin-path", "mine.py", "--out", "again")
    assert said.stderr == ""
