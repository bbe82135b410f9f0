"""`tussle stress`: what it prints, keeps, continues and refuses."""

from __future__ import annotations

import json
import re
import shlex
import signal
import subprocess
import time
from pathlib import Path

import pytest
from cli_process import COMMAND, environment

EXAMPLE = Path(__file__).parents[3] / "examples/stress"
STUDY = (
    *("stress", EXAMPLE / "pads.xml", "--plugin-path", EXAMPLE / "hover.py", "--end", "6"),
    *("--spec", "always (distance(left, right) > 3 m)", "--processes", "1", "--out", "out"),
)
SPLIT = (*STUDY, "--probability", "--particles", "20", "--repetitions", "4")


def test_a_study_from_question_to_a_failing_game(tussle, folder):
    done = tussle(*SPLIT, "--why")
    assert re.search(r"probability of failure +\S+ \(\S+–\S+\)", done.stdout)
    assert "plain games would be" in done.stdout
    command = " ".join(done.stdout.split()).partition(" tussle run ")[2].partition(" from t ")[0]
    listed = json.loads((folder / "out/result.json").read_text())["failures"]
    played = tussle("run", *shlex.split(command))
    assert listed[0]["state_hash"] in played.stdout
    assert "branches that fail" in done.stdout
    assert re.search(r" 1 \(0\.\d+–1\)", done.stdout)
    assert re.search(r"luck of left +0 +0\.?\d* \(\S+\) +yes", done.stdout)
    assert re.search(r"undone by +luck left", done.stdout)
    assert re.search(r"saved at t \[s\] +\d", done.stdout)
    tussle("run", folder / "out/failures/0-saved.xml", "--plugin-path", EXAMPLE / "hover.py")
    (command,) = [line for line in done.stdout.splitlines() if line.startswith(" tussle replay")]
    runs = shlex.split(command)[2:]
    assert runs[:2] == ["out/failures/0", "out/failures/0-saved"]
    assert (
        json.loads((folder / runs[0] / "run.json").read_text())["worlds"][0]["state_hash"]
        == listed[0]["state_hash"]
    )
    tussle("export", *runs, "--html", "both.html")
    page = (folder / "both.html").read_text()
    document = json.loads(re.search(r'id="document">(.*?)</script>', page)[1])
    failed, saved = document["alarms"]
    assert failed["failed"] is not None
    assert saved["failed"] is None
    assert failed["least"][-1] == listed[0]["robustness"]
    why = json.loads((folder / "out/result.json").read_text())["why"]
    assert (why["file"], why["saved"]) == ("failures/0.xml", "failures/0-saved.xml")
    assert {row["kind"] for row in why["rows"]} == {"luck", "entity"}
    plain = tussle(*STUDY, "-n", "30")
    assert re.search(r"failed +\d+ of 30 games", plain.stdout)
    assert re.search(r"robustness +\S+, \S+, \S+ \(least", plain.stdout)
    assert len((folder / "out/games.jsonl").read_text().splitlines()) >= 80


def test_a_study_that_is_killed_goes_on(process, tussle, folder):
    """And ends as one that was not."""
    command = [*COMMAND, *map(str, SPLIT), "--why"]
    for wait in (3.0, 5.0, 6.0):
        with subprocess.Popen(
            command, cwd=folder, env=environment(), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        ) as one:
            time.sleep(wait)
            one.send_signal(signal.SIGKILL)
    process(*SPLIT, "--why")
    result = (folder / "out/result.json").read_text()
    assert '"why"' in result
    tussle(*SPLIT, "--why", "--processes", "2", "--out", "other")
    assert (folder / "other/result.json").read_text() == result


def test_the_smallest_failing_game_plays_alone(tussle, folder):
    done = tussle(*STUDY, "-n", "3", "--spec", "always (distance(left, right) > 7.5 m)", "--shrink")
    assert "no part of it can be left out" in " ".join(done.stdout.split())
    small = folder / "out/failures/smallest.xml"
    assert 'end="6' not in small.read_text()
    tussle("run", small, "--plugin-path", EXAMPLE / "hover.py")


def test_a_check_ends_with_an_exit_code(tussle, folder):
    check = (*STUDY, "-n", "40", "--holds", "0.9", "--junit", "xml/stress.xml")
    done = tussle(*check, "--spec", "always (distance(left, right) > 7 m)", "--out", "bad", code=6)
    assert "does not hold with 95 % confidence above 0.9" in " ".join(done.stdout.split())
    assert "bad/failures/0.xml" in (folder / "xml/stress.xml").read_text()
    tussle(*check)
    assert "<failure" not in (folder / "xml/stress.xml").read_text()


@pytest.mark.parametrize(
    ("changes", "message", "code"),
    [
        (("--holds", "1"), "it takes a probability from 0 to less than 1", 2),
        (("--junit", "a.xml"), "--junit needs --holds", 2),
        (("--spec", ""), "--spec is missing", 2),
        (("--spec", "always (distance(left, right) > 3 s)"), "m and s cannot be compared", 1),
        (("--spec", "scores[1] > 3"), "there is no 'scores", 1),
        (("--spec", "always (nothing(left) > 3)"), "there is no signal 'nothing'", 1),
        (("--set", "left.Hover.gust=0", "--set", "right.Hover.gust=0", "--probability"), "no randomness", 1),
    ],
)
def test_what_is_refused_is_said_in_one_sentence(tussle, changes, message, code):
    done = tussle(*STUDY, *changes, code=code)
    assert message in " ".join(done.stderr.split())
    assert "Traceback" not in done.stderr


def test_different_failures_are_told_from_failed_games(tussle):
    nearer = ("--spec", "always (distance(left, right) > 9 m)")
    done = tussle(
        *STUDY, *nearer, "-n", "60", "--vary", "left.Hover.gust=6:9", "--vary", "right.Hover.gust=1:9"
    )
    text = " ".join(done.stdout.split())
    n_failed = re.search(r"failed (\d+) of 60", text).group(1)
    assert re.search(
        rf"the worst 5 of \d+ different failures among {n_failed} failed games; \d+ are kept", text
    )


def test_a_search_for_values_that_fail(tussle, folder):
    search = (*STUDY, "-n", "160", "--vary", "left.Hover.gust=1:9", "--vary", "left.Hover.gain=-0.1:1")
    done = tussle(*search, "--why")
    text = " ".join(done.stdout.split())
    assert re.search(r"failed [1-9]\d* of 160 games first failure game \d+ least robustness -\d", text)
    assert "branches that fail" in text
    assert re.search(r"failures/0.xml: left.Hover.gust=\S+, left.Hover.gain=0\.\d+", text)
    assert re.search(
        r"sets of values cannot be played, as left.Hover.gust=\S+ left.Hover.gain=-",
        " ".join(done.stderr.split()),
    )
    played = tussle("run", folder / "out/failures/0.xml", "--plugin-path", EXAMPLE / "hover.py")
    assert json.loads((folder / "out/result.json").read_text())["failures"][0]["state_hash"] in played.stdout
    compared = tussle(
        *STUDY,
        "-n",
        "60",
        "--spec",
        "always (distance(left, right) > 6 m)",
        "--against",
        "left.Hover.gust=0,right.Hover.gust=0",
        "--out",
        "other",
    )
    assert "the same game of the other mission does not" in " ".join(compared.stdout.split())


RARE = (
    *("stress", EXAMPLE / "pair.xml", "--spec", "always (distance(left, right) > 1 m)", "--processes", "1"),
    *("--probability", "--importance", "--vary", "right_x=normal(14, 1)", "-n", "60", "--out", "out"),
)


@pytest.mark.slow
def test_importance_sampling_of_a_start_position(tussle, folder):
    """The distance at the end is 6 m less than a normal number: it fails beyond 5 standard deviations."""
    done = tussle(*RARE, "--why", "--holds", "0.99")
    text = " ".join(done.stdout.split())
    assert re.search(r"probability of failure \S+e-07 \(\S+\)", text)
    assert re.search(r"effective failing games of \d+; the greatest weight is \d+\.\d% of all", text)
    assert re.search(r"failures/0.xml: right_x=\d", text)
    assert "undone by nothing that was tried" in text
    assert "holds with 95 % confidence above 0.99" in text
    assert "cannot be trusted" in " ".join(done.stderr.split())
    result = json.loads((folder / "out/result.json").read_text())
    assert result["low"] < 2.87e-7 < result["high"]
    played = tussle("run", folder / "out/failures/0.xml")
    assert result["failures"][0]["state_hash"] in played.stdout


@pytest.mark.parametrize(
    ("changes", "message", "code"),
    [
        (("--vary", "left_x=0:1"), "left_x varies without a distribution", 1),
        (("--vary", "left_x=gauss(0, 1)"), "there is no distribution 'gauss'", 1),
        (
            ("--vary", "left_x=normal(30, 1)", "--spec", "always (distance(left, right) > 50 m)"),
            "all of 400 games fail",
            1,
        ),
        (("--against", "left_x=3"), "it does not compare missions", 2),
    ],
)
def test_importance_sampling_that_is_refused(tussle, changes, message, code):
    done = tussle(*RARE, *changes, code=code)
    assert message in " ".join(done.stderr.split())
    assert "Traceback" not in done.stderr


def test_importance_sampling_needs_values(tussle):
    done = tussle(
        "stress", EXAMPLE / "pair.xml", "--spec", "count(all) > 1", "--probability", "--importance", code=2
    )
    assert "--importance needs --probability, and --vary" in " ".join(done.stderr.split())
