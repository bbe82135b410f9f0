"""The texts of the report of a batch; its pictures are not drawn here."""

from __future__ import annotations

import re

import numpy as np
import pytest
from made_batches import made_batch, write_batch
from reported_batches import choices, names_of, noise, ranges, scores_of_the_paper, texts_of

from tussle.batch.sampling import sample
from tussle.batch.store import load
from tussle.batch.variables import Choice, Range
from tussle.errors import ParameterError


@pytest.fixture(scope="module")
def paper(tmp_path_factory):
    """A batch without variables, played from a mission file."""
    stored = made_batch(scores_of_the_paper())
    stored.info.update(
        mission={
            "made_in": "file", "file": "predator_prey.xml", "settings": {"end": "100"}, "ends_by_time": False,
            "plugin_files": [], "options": {},
        },
        command=["tussle", "batch", "predator_prey", "--runs", "1000", "--end", "100"],
        versions={"python": "3.11.7", "tussle": "0.1"},
        timings={"began": "2026-11-21T19:40:00+00:00", "wall_s": 812.3, "cpu_s": 1600.2},
    )  # fmt: skip
    return load(write_batch(stored, tmp_path_factory.mktemp("place") / "paper"))


def test_the_first_sentence_answers(paper):
    assert (
        "keepers won 593 of 1,000 games (59.3 %, 95 % interval 56.2 to 62.3), switchers 361 (36.1 %, 33.2 to 39.1), 46 ties."
    ) in texts_of(paper)


def test_it_tells_how_the_batch_was_made(paper):
    said = texts_of(paper)
    for fact in (
        "command tussle batch predator_prey --runs 1000 --end 100", "mission predator_prey.xml", "settings end=100",
        "seeds 1 to 1000", "versions python 3.11.7, tussle 0.1", "played 2026-11-21 19:40:00 UTC", "took 14 min",
    ):  # fmt: skip
        assert f"\n{fact}" in said


def test_a_mission_made_in_python_has_no_such_command(tmp_path):
    stored = choices()
    stored.info["mission"] = {"made_in": "python"}
    said = texts_of(load(write_batch(stored, tmp_path / "made")))
    assert "Slowest games" in said
    assert "--from" not in said


def test_two_ranges_have_effects_a_map_and_strengths():
    stored = ranges()
    names, said = names_of(stored), texts_of(stored)
    assert {
        "effects",
        "maps",
        "strengths",
        "points",
        "wins-by-prey_speed",
        "score-by-gain",
        "wins-map",
        "score-map",
    } <= names
    assert "strengths-score_2" in names
    assert "differences" not in names
    assert "Which gain? The share of games won by keepers falls from 8" in said
    assert "Which prey_speed? The share of games won by keepers is highest at 20.8 kt, 8" in said
    assert "80 points: a Latin hypercube, drawn with seed 0." in said
    assert "The 10 points with most and the 10 with least games won by keepers, of 80." in said


def test_a_choice_has_paired_differences():
    said = texts_of(choices())
    assert "differences" in names_of(choices())
    assert "score of keepers tactic=keep → tactic=switch 40 " in said
    assert "+3.00 3.00 to 3.00 40 / 0 / 0 < 0.001" in said
    assert "score of switchers tactic=keep → tactic=switch 40 " in said
    assert "0 / 0 / 40 1.00" in said  # of team 3, which the choice does not change


def test_values_that_cannot_be_named_are_said_not_to_be_compared():
    variables = [Choice("where", ("here ", "there")), Choice("tactic", ("keep", "switch"))]
    points = sample(variables, "grid")
    scores = {2: noise(4, 5, 9.0), 3: noise(4, 5, 9.0, 1)}
    said = texts_of(made_batch(scores, variables=variables, points=points, sample="grid"))
    assert "The values of where are not compared: " in said
    assert "tactic=keep → tactic=switch" in said


def test_failed_games_are_counted_and_told():
    said = texts_of(choices(failed={3: "MyBoids: float division by zero", 8: "it left nan in pos_x"}))
    assert "2 games of 80 failed" in said
    assert "of 78 games" in said
    assert "3 2 tactic=switch MyBoids: float division by zero" in said


def test_what_is_missing_and_what_stopped_the_batch_stands_at_the_top():
    stored = choices(missing=[78, 79])
    stored.notes.append("the batch is not complete: 78 of 80 runs are finished")
    stored.info["stopped_by"] = "wins[2]±0.02 after 40 seeds"
    said = texts_of(stored)
    head = said[: said.index("Who won")]
    assert "78 of 80 runs are finished" in head
    assert "wins[2]±0.02 after 40 seeds" in head


@pytest.mark.parametrize(
    ("scores", "options", "answer"),
    [
        ({2: [[3]], 3: [[1]]}, {}, "keepers won 1 of 1 game (100.0 %"),
        ({2: [[3], [2]], 3: [[3], [2]]}, {}, "All 2 games ended in ties."),
        ({2: [[3]], 3: [[3]]}, {}, "The only game ended in a tie."),
        ({2: [[3], [2]], 3: [[1], [1]]}, {"failed": {0: "x", 1: "y"}}, "All 2 games failed."),
        ({2: [[3], [2]], 3: [[1], [1]]}, {"missing": [0, 1]}, "No game is finished yet."),
    ],
)
def test_batches_with_little_in_them(scores, options, answer):
    assert answer in texts_of(made_batch(scores, **options))


def test_without_scores_it_tells_who_was_left():
    lost = {
        run: [(1, 0.0, 50), (1, 10.0 + run, 20 + run), (1, 100.0, 20 + run), (2, 0.0, 5), (2, 100.0, 5)]
        for run in range(30)
    }
    stored = made_batch({}, metrics={"M.x": {None: np.ones((30, 1))}}, alive=lost)
    said = texts_of(stored)
    assert re.search(
        r"On average, 34.5 of 50 prey were left \(95 % interval 3\d.\d to 3\d.\d\) in 30 games", said
    )
    assert "won" not in names_of(stored)
    assert "left" in names_of(stored)


def test_a_quantity_that_is_asked_for_has_plots_of_its_own():
    names = names_of(choices(), ["score[2]-score[3]"])
    assert {
        "score_2_score_3-by-tactic",
        "strengths-score_2_score_3",
    } <= names
    assert not {name for name in names_of(choices()) if "score_2_score_3" in name}
    with pytest.raises(ParameterError, match=r"score\[9\]"):
        texts_of(choices(), ["score[9]"])


def test_quantities_with_names_alike_have_files_of_their_own():
    names = names_of(choices(), ["score[2]-score[3]", "score[2]+score[3]"])
    assert {"score_2_score_3-by-tactic", "score_2_score_3-by-tactic-2"} <= names


def test_many_variables_and_points_are_gathered_and_it_is_said():
    variables = [Range(f"x{i}", 0.0, 1.0) for i in range(8)]
    points = sample(variables, "sobol", 1024, 1)
    x = np.array([[p[v.name] for v in variables] for p in points])
    mean = 5.0 + 20.0 * x[:, 5] + 9.0 * x[:, 2]
    scores = {2: np.random.default_rng(5).poisson(mean, (1, 1024)), 3: noise(1024, 1, 15.0)}
    said = texts_of(made_batch(scores, variables=variables, points=points, sample="sobol"))
    assert "6 of 8 variables" in said
    assert re.search(
        r"keepers won \d+ of 1,024 games over 1,024 points \([\d.]+ %\), switchers \d+ \([\d.]+ %\)", said
    )
    assert "nan" not in said
    assert "Line: smooth fit (Gaussian process), the other variables as at all points." in said
    assert "switchers minus keepers, by x2 and x5" in said  # the map is of the two that matter
    assert "The two strongest of 8 variables that are numbers." in said
