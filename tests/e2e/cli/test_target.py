"""The question of a command line: what the batch, the analysis and the report answer."""

from __future__ import annotations

import html
import json
import re
import shutil
from pathlib import Path

import gambles
import pytest
from typer.testing import CliRunner

from tussle.batch import load_batch
from tussle.cli.app import app

BATCH = (
    "batch",
    "chance.xml",
    "--plugin-path",
    "plugins.py",
    "--vary",
    "reds=1,3,5",
    "--processes",
    1,
    "--out",
    "out",
)
QUESTION = ("--target", "score[1] >= 1.8")


@pytest.fixture
def call(tmp_path, monkeypatch):
    """Calls the command in this process, and gives what it prints as one line."""
    (tmp_path / "chance.xml").write_text(gambles.MISSION)
    shutil.copy(gambles.THIS, tmp_path / "plugins.py")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))

    def call(*arguments):
        words = [str(a) for a in arguments]
        monkeypatch.setattr("sys.argv", ["tussle", *words])
        done = CliRunner().invoke(app, words)
        assert done.exception is None or isinstance(done.exception, SystemExit), done.exception
        return done.exit_code, re.sub(r"\s+", " ", done.stdout)

    return call


def test_the_question_is_answered_by_the_batch_the_analysis_and_the_report(call):
    code, printed = call(*BATCH, *QUESTION, "--runs", 200)
    assert code == 0
    code, text = call("analyze", "out", "--json")
    found = json.loads(text)["target"]
    assert (found["target"], found["over"]) == ("score[1] >= 1.8", "reds")
    (sentence,) = found["sentences"]
    assert sentence.startswith("reds = ")
    assert sentence in printed
    assert "hold together, and whenever one stops" in printed
    code, analyzed = call("analyze", "out")
    assert (code, sentence in analyzed) == (0, True)
    (answer,) = found["answers"]
    assert answer["is_decided"]
    assert "score[1] >= 1.8 is known, with up to" in printed
    assert call("report", "out")[0] == 0
    page = html.unescape(Path("out/report/index.html").read_text())
    assert page.index('<p class="answer">') < page.index(sentence) < page.index("<nav")


def test_another_question_is_answered_by_the_games_that_are_there(call):
    assert call(*BATCH, "--runs", 20)[0] == 0
    code, printed = call("analyze", "out")
    assert (code, "target" in printed) == (0, False)
    code, printed = call("analyze", "out", *QUESTION)
    assert code == 0
    assert "more games of" in printed
    command = next(p for p in printed.split(" tussle ")[1:] if p.startswith("batch chance.xml"))
    assert "--vary reds=1,3,5 --processes 1 --out out --target 'score[1] >= 1.8'" in command
    assert call("analyze", "out", "--target", "score[1]")[0] == 1


def test_only_points_whose_interval_is_wide_are_played_on(call):
    code, printed = call(*BATCH, "--until", "width(score[1]) < 2")
    assert code == 0
    assert "width(score[1]) < 2.0 is known, with up to" in printed
    results = load_batch("out")
    games = results.n_runs_by_point()[0]
    assert games.min() < games.max()
