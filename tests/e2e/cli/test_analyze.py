"""tussle analyze: what came of a batch, for people and for programs."""

from __future__ import annotations

import json

import numpy as np
import pytest
from made_batches import made_batch, write_batch

from tussle.batch.sampling import sample
from tussle.batch.variables import Choice, Range


@pytest.fixture
def paired(folder):
    """Forty seeds at four points: the second tactic scores one more at each; one run failed, with words that are marks elsewhere."""
    variables = [
        Choice("tactic", ("keep", "switch")),
        Range("prey.Boids.speed", 20.0, 30.0, levels=2, unit="kt"),
    ]
    luck = np.random.default_rng(1).poisson(8.0, (40, 1))
    scores = {2: luck + np.array([0, 3, 1, 4]), 3: np.full((40, 4), 9.0)}
    batch = made_batch(
        scores,
        variables=variables,
        points=sample(variables, "grid"),
        sample="grid",
        failed={9: "SimpleCapture: value [bold]nan"},
    )
    return write_batch(batch, folder / "paired")


def lines_of(text: str, head: str) -> list[list[str]]:
    """Words of the lines of a table, from its title to the end of its rows."""
    lines = text.splitlines()
    begin = next(i for i, line in enumerate(lines) if line.startswith(f" {head}"))
    rule = next(i for i in range(begin, len(lines)) if lines[i].startswith(" ──"))
    rest = lines[rule + 1 :]
    return [line.split() for line in rest[: rest.index("")]]


def test_the_page_says_who_won_how_surely_and_what_differs(tussle, paired):
    text = tussle("analyze", paired).stdout
    lines = text.splitlines()
    assert lines[1:3] == [" A made game", " 160 runs · 4 points × 40 seeds · 1 failed"]
    assert text.replace("\n", "").count(str(paired)) == 1
    assert max(map(len, lines)) <= 80
    keepers, _switchers, ties = lines_of(text, "who won")
    assert keepers[:2] == ["2", "keepers"]
    assert int(keepers[2]) + int(_switchers[2]) + int(ties[1]) == 159
    (score, *_) = lines_of(text, "means")
    assert score[:2] == ["score[2]", "keepers"]
    assert "[kt]" in text.split()
    points = lines_of(text, "points")
    assert [row[:3] for row in points] == [
        ["0", "keep", "20"],
        ["1", "keep", "30"],
        ["2", "switch", "20"],
        ["3", "switch", "30"],
    ]
    (difference,) = lines_of(text, "compared")
    assert difference == ["tactic=switch", "+1", "1", "–", "1", "79", "0", "0", "<", "0.001"]
    effects = lines_of(text, "what score of keepers depends on")
    assert [row[0] for row in effects] == ["tactic", "speed", "interaction", "seed"]
    assert lines_of(text, "failed") == [
        ["SimpleCapture:", "value", "[bold]nan", "(tactic=keep,", "1", "9", "3"],
        ["prey.Boids.speed=30", "kt)"],
    ]


def test_json_has_all_of_it(tussle, paired):
    found = json.loads(tussle("analyze", paired, "--json").stdout)
    assert (found["n_runs"], found["n_failed"], found["n_points"]) == (160, 1, 4)
    assert [point["label"] for point in found["points"]][3] == "tactic=switch, prey.Boids.speed=30 kt"
    (comparison,) = found["comparisons"]
    assert (comparison["difference"], comparison["n_greater"], comparison["n"]) == (1.0, 79, 79)
    assert found["failures"][0]["seed"] == 3


def test_quantities_and_comparisons_can_be_asked_for(tussle, paired):
    text = tussle(
        "analyze", paired, "--quantity", "score[2]-score[3]", "--quantity", "t", "--compare", "prey.Boids.speed=20", "1"
    , code=1).stderr  # fmt: skip
    assert "'prey.Boids.speed=20' and '1' select several points by different variables" in text
    done = tussle(
        "analyze",
        paired,
        "--quantity",
        "score[2]-score[3]",
        "--compare",
        "prey.Boids.speed=20",
        "prey.Boids.speed=30 kt",
    )
    first, *_folded = lines_of(done.stdout, "compared")
    assert first[2:6] == ["+3", "3", "–", "3"]
    assert "score[2]-score[3]" in done.stdout
    assert "alive[1]" not in done.stdout


def test_twenty_points_are_shown_or_all(tussle, folder):
    variables = [Range("speed", 20.0, 30.0)]
    points = sample(variables, "lhs", 50, seed=1)
    scores = {2: np.array([[p["speed"] for p in points]]), 3: np.zeros((1, 50))}
    path = write_batch(made_batch(scores, variables=variables, points=points, sample="lhs"), folder / "fifty")
    text = tussle("analyze", path).stdout
    rows = lines_of(text, "points")
    shown = [float(row[1]) for row in rows if row != ["..."]]
    ordered = sorted((p["speed"] for p in points), reverse=True)
    assert shown == [float(f"{speed:.6g}") for speed in ordered[:10] + ordered[-10:]]
    assert "30 points between the highest and the lowest score[2] are left out" in text
    rows = lines_of(tussle("analyze", path, "--by-point").stdout, "points")
    assert [int(row[0]) for row in rows] == list(range(50))


def test_a_batch_that_goes_on_is_shown_and_said_to(tussle, folder):
    path = write_batch(
        made_batch({2: np.ones((10, 1)), 3: np.zeros((10, 1))}, missing=[8, 9]), folder / "half"
    )
    done = tussle("analyze", path)
    assert " 8 of 10 runs" in done.stdout
    assert "8 of 10 runs are finished" in done.stderr
    nothing = write_batch(made_batch({2: np.ones((2, 1))}, missing=[0, 1]), folder / "nothing")
    assert " 0 of 2 runs" in tussle("analyze", nothing).stdout


@pytest.mark.parametrize(
    ("arguments", "words", "code"),
    [
        (["game.xml", "--json"], "game.xml: ", 4),
        (["paired", "--quantity", "scor[2]"], "did you mean 'score[2]'?", 1),
        (["paired", "--compare", "tactic=keep", "tactic=kep", "--json"], "did you mean 'keep'?", 1),
    ],
)
@pytest.mark.usefixtures("paired")
def test_what_is_not_there_is_told_in_one_line(tussle, arguments, words, code):
    done = tussle("analyze", *arguments, code=code)
    assert done.stdout == ""
    assert done.stderr.startswith("error: ")
    assert words in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_a_played_batch_is_analysed(tussle):
    tussle("batch", "game.xml", "--runs", "3", "--vary", "n=10,5", "--out", "played")
    found = json.loads(tussle("analyze", "played", "--json").stdout)
    assert (found["n_runs"], found["n_points"], found["n_failed"]) == (6, 2, 0)
    assert {c["b"] for c in found["comparisons"]} <= {"n=5"}
    assert "hunters" in tussle("analyze", "played").stdout
