"""From which value on a target is reached: for grids, hypercubes and choices, whatever the shape of the curve."""

from __future__ import annotations

import shlex

import gambles
import numpy as np
import pytest
from gambles import rows
from made_batches import made_batch

from tussle.batch import Batch, Choice, InProcess, Range, load_batch
from tussle.batch.further import further_runs, without
from tussle.batch.results import Results
from tussle.batch.sampling import sample
from tussle.batch.sequential import Question, Width, rule_of
from tussle.batch.stopping import Until
from tussle.batch.target import Target
from tussle.errors import ParameterError

TACTIC = Choice("tactic", ("lanes", "random"))


@pytest.mark.parametrize(
    ("text", "written", "reached"),
    [
        ("Guard.share >= 0.95", "Guard.share >= 0.95", 0.96),
        ("wins[2]>90 %", "wins[2] >= 0.9", 0.95),
        ("lost[1] / start[1] < 0.2", "lost[1] / start[1] <= 0.2", 0.1),
        ("t ≤ -1e2", "t <= -100.0", -200.0),
    ],
)
def test_a_target_is_read_and_written_again(text, written, reached):
    target = Target.parse(text)
    assert str(target) == written
    assert Target.parse(written) == target
    assert target.is_reached(reached)
    assert target.state(reached, reached) == "reached"
    assert not target.is_reached(2.0 * target.bound - reached)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("Guard.share", "no sign"),
        ("0 <= Guard.share <= 1", "more than one sign"),
        ("Guard.share >= much", "no finite number"),
        ("Guard.share >= nan", "no finite number"),
        (">= 1", "no quantity"),
        ("Guard share >= 1", "cannot be read"),
    ],
)
def test_what_is_no_target_is_refused(text, words):
    with pytest.raises(ParameterError, match=words):
        Target.parse(text)


def answered(means, variables, points, target="Guard.share >= 0.8", over=None, n_seeds=300, seed=1, **more):
    """The answers of a batch whose games are won with these probabilities."""
    won = np.random.default_rng(seed).random((n_seeds, len(points))) < means
    made = made_batch({}, variables=variables, points=points, metrics={"Guard.share": {None: won}}, **more)
    return Results(made).answers(target, over)


def test_a_grid_with_a_choice_has_an_answer_for_each_of_its_values():
    n = Range("n", 4, 16, is_int=True)
    points = [{"tactic": t, "n": v} for t in TACTIC.values for v in (4, 8, 12, 16)]
    means = np.array([0.3, 0.6, 0.97, 0.99, 0.1, 0.2, 0.4, 0.5])
    answers = answered(means, [TACTIC, n], points)
    lanes, random = answers.answers
    assert [level.state for level in lanes.levels] == ["missed", "missed", "reached", "reached"]
    assert (lanes.label, lanes.smallest.low, lanes.gap, lanes.is_decided) == (
        "tactic=lanes",
        12,
        (8, 12),
        True,
    )
    assert (random.smallest, random.at_least, random.is_decided, random.gap) == (None, None, True, None)
    assert 8 < lanes.crossing.low < lanes.crossing.value < lanes.crossing.high < 12
    assert random.crossing is None
    first, second = answers.sentences()
    assert first.startswith("tactic=lanes: n = 12 reaches Guard.share >= 0.8: 0.9")
    assert "; 8 does not; by a smooth fit it takes" in first
    assert second.startswith(
        "tactic=random: no value of n from 4 to 16 reaches Guard.share >= 0.8; nearest is 16: "
    )


def test_without_a_choice_there_is_one_answer_and_all_may_reach_it():
    points = [{"n": v} for v in (4, 8, 12)]
    (answer,) = (found := answered(np.array([0.97, 0.98, 0.99]), [Choice("n", (4, 8, 12))], points)).answers
    assert (answer.label, answer.smallest.low, answer.gap, answer.is_decided) == ("", 4, None, True)
    assert found.sentences()[0].startswith("n = 4 reaches Guard.share >= 0.8")
    assert "it is the smallest that was played" in found.sentences()[0]


def test_two_choices_are_answered_for_each_pair():
    wind = Choice("wind", (0, 10))
    points = [{"n": v, "tactic": t, "wind": w} for v in (1, 2, 3) for t in TACTIC.values for w in (0, 10)]
    means = np.array([0.1 * (3 * p["n"]) + 0.06 * (p["tactic"] == "lanes") for p in points])
    answers = answered(means, [Range("n", 1, 3, is_int=True), TACTIC, wind], points, "Guard.share >= 0.7")
    assert [a.values for a in answers.answers] == [
        {"tactic": t, "wind": w} for t in TACTIC.values for w in (0, 10)
    ]
    assert [a.smallest.low for a in answers.answers] == [3, 3, 3, 3]


def test_a_quantity_that_falls_is_reached_at_first_and_missed_again():
    points = [{"n": v} for v in (4, 8, 12)]
    answers = answered(np.array([0.97, 0.95, 0.3]), [Range("n", 4, 12)], points)
    assert answers.answers[0].missed_above.low == 12
    assert "12 misses it again" in answers.sentences()[0]
    fewer = answered(np.array([0.97, 0.95, 0.3]), [Range("n", 4, 12)], points, "Guard.share <= 0.5")
    assert "n = 12 reaches Guard.share <= 0.5" in fewer.sentences()[0]


def test_a_few_games_leave_an_answer_open():
    points = [{"n": v} for v in (4, 8, 12)]
    answers = answered(np.array([0.1, 0.75, 0.9]), [Range("n", 4, 12)], points, n_seeds=30)
    (answer,) = answers.answers
    assert not answer.is_decided
    assert (answer.smallest, answer.at_least.low) == (None, 8)
    assert answers.sentences()[0].startswith(
        "open: no value is sure to reach Guard.share >= 0.8 yet; the smallest that may is n = 8: "
    )
    assert set(answers.wanted()) <= {1, 2}
    assert answers.wanted()
    assert answers.wanted(30) == []


def test_of_a_hypercube_neighbouring_values_are_taken_together():
    variables = [Range("n", 2, 20), Range("speed", 10, 30)]
    points = sample(variables, "lhs", 40, 0)
    means = np.array([min(1.0, p["n"] / 12) for p in points])
    answers = answered(means, variables, points, sample="lhs")
    (answer,) = answers.answers
    assert answers.over.name == "n"
    assert len(answer.levels) == 8
    assert all(len(level.points) == 5 for level in answer.levels)
    assert 8.0 < answer.smallest.low < 12.5
    assert any("taken together" in note for note in answers.notes)
    assert 9.0 < answer.crossing.value < 10.2
    turned = answered(means, variables, points, sample="lhs", over="speed")
    assert turned.over.name == "speed"
    assert turned.answers[0].smallest is None


def test_a_hypercube_of_one_range_has_a_level_for_each_value():
    variables = [Range("n", 2, 20)]
    points = sample(variables, "lhs", 12, 0)
    (answer,) = answered(np.array([min(1.0, p["n"] / 12) for p in points]), variables, points).answers
    assert len(answer.levels) == 12
    assert [level.low for level in answer.levels] == sorted(p["n"] for p in points)


def test_without_a_number_that_varies_each_choice_reaches_it_or_not():
    answers = answered(np.array([0.97, 0.4]), [TACTIC], [{"tactic": t} for t in TACTIC.values])
    assert answers.over is None
    assert [s.partition(":")[0] for s in answers.sentences()] == ["tactic=lanes", "tactic=random"]
    assert [s.split()[1] for s in answers.sentences()] == ["reaches", "misses"]
    nothing = answered(np.array([0.97]), [], [{}])
    assert nothing.sentences()[0].startswith("reaches Guard.share >= 0.8: ")
    assert nothing.as_dict()["answers"][0]["levels"][0]["from"] is None


@pytest.mark.parametrize(
    ("over", "words"),
    [("tactic", "no numbers"), ("tactics", "was not varied .did you mean 'tactic'")],
)
def test_another_variable_must_be_one_of_numbers(over, words):
    points = [{"tactic": t, "n": v} for t in TACTIC.values for v in (1, 2)]
    with pytest.raises(ParameterError, match=words):
        answered(np.full(4, 0.5), [TACTIC, Range("n", 1, 2)], points, over=over)


def test_failed_and_missing_runs_are_not_counted():
    points = [{"n": v} for v in (4, 8)]
    answers = answered(
        np.array([0.97, 0.98]), [Range("n", 4, 8)], points, failed={0: "broken", 2: "broken"}, missing=[1]
    )
    assert [level.n for level in answers.answers[0].levels] == [298, 299]


# -- the rule ---------------------------------------------------------------------------------------------------------------------


def test_rules_are_told_apart_by_their_form():
    assert isinstance(rule_of("0.02"), Until)
    assert rule_of(None) is None
    assert rule_of("width(Guard.share) < 0.02") == Question(None, Width.parse("width(Guard.share)<0.02"))
    both = rule_of("width(Guard.share) < 0.02", "Guard.share >= 0.9", "n")
    assert str(both) == "Guard.share >= 0.9 over n; width(Guard.share) < 0.02"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("width(Guard.share) < 0",), "> 0"),
        (("width(Guard.share) < wide",), "'wide' is not allowed"),
        (("0.02", "Guard.share >= 0.9"), "not allowed with a target"),
        (("0.02", None, "n"), "there is none"),
    ],
)
def test_rules_that_do_not_go_together_are_refused(arguments, words):
    with pytest.raises(ParameterError, match=words):
        rule_of(*arguments)


class Enough(Exception):
    pass


@pytest.fixture
def mission(tmp_path):
    file = tmp_path / "game.xml"
    file.write_text(gambles.MISSION)
    return file


def batch(mission, runs=120):
    return Batch(mission, runs=runs, vary=["reds=1,2,3,4,5"], plugin_files=[gambles.THIS])


RULES = [
    {"target": "score[1] >= 1.2"},
    {"until": "width(score[1]) < 1"},
    {"target": "score[1] >= 1.2", "until": "width(score[1]) < 1"},
]


@pytest.mark.parametrize("rule", RULES, ids=str)
def test_only_what_is_needed_is_played_whoever_plays_it_and_whatever_interrupts(mission, tmp_path, rule):
    reference = batch(mission).play(tmp_path / "reference", InProcess(1), **rule)
    by_point = reference.n_runs_by_point()[0] + reference.n_runs_by_point()[1]
    assert by_point.min() == 20 < by_point.max()
    assert reference.info["is_partial"]
    assert reference.n_planned == reference.n_runs == by_point.sum()
    assert rows(batch(mission).play(executor=InProcess(64), **rule)) == rows(reference)

    def watch(progress):
        if progress.n_done - progress.n_before >= 101:
            raise Enough

    path = tmp_path / "out"
    for _ in range(100):
        try:
            results = batch(mission).play(path, InProcess(13), on_progress=watch, **rule)
            break
        except Enough:
            pass
    assert rows(results) == rows(reference)
    again = batch(mission)
    assert rows(again.play(path, None, **rule)) == rows(reference)
    assert load_batch(path).info["target"] == rule.get("target")


def test_a_batch_with_a_target_goes_on_to_a_whole_one_and_back(mission, tmp_path):
    path = tmp_path / "out"
    batch(mission).play(path, InProcess(64), target="score[1] >= 1.2")
    whole = batch(mission, 30).play(path, InProcess(64))
    played = whole.n_runs_by_point()[0] + whole.n_runs_by_point()[1]
    assert played.min() == 30
    assert whole.info["target"] is None
    answers = batch(mission).play(path, InProcess(64), target="score[1] >= 1.2").answers()
    assert answers is not None
    assert str(answers.target) == "score[1] >= 1.2"


def test_a_quantity_that_no_game_has_is_refused_before_the_batch(mission, tmp_path):
    with pytest.raises(ParameterError, match=r"there is no 'scor\[1\]' .did you mean 'score\[1\]'"):
        batch(mission).play(tmp_path / "out", target="scor[1] >= 1")
    assert not (tmp_path / "out").exists()


# -- further runs -------------------------------------------------------------------------------------------------------------------


def test_the_command_that_narrows_an_answer_can_be_typed(tmp_path):
    points = [{"tactic": t, "n": v} for t in TACTIC.values for v in (4, 8)]
    answers = answered(np.array([0.1, 0.97, 0.7, 0.8]), [TACTIC, Range("n", 4, 8, is_int=True)], points)
    command = [
        "tussle", "batch", "my game.xml", "--vary", "tactic=lanes,random", "--vary=n=4,8", "-n", "100", "--until=0.1",
        "--target", "Guard.share > 0.5", "wind=3", "--samples", "7", "--out=there", "--set", "n=1",
    ]  # fmt: skip
    info = {"command": command, "n_seeds": 300}
    (games, more), (between, finer) = further_runs(answers, info, tmp_path)
    assert games.startswith("more games of ")
    assert shlex.split(more) == [
        "tussle", "batch", "my game.xml", "--vary", "tactic=lanes,random", "--vary", "n=4,8", "wind=3", "--samples", "7",
        "--set", "n=1", "--out", str(tmp_path), "--target", "Guard.share >= 0.8",
    ]  # fmt: skip
    assert between == "values between with tactic=lanes"
    assert shlex.split(finer) == [
        "tussle", "batch", "my game.xml", "wind=3", "--vary", "n=5,6,7", "--set", "tactic=lanes", "--target", "Guard.share >= 0.8",
    ]  # fmt: skip
    assert further_runs(answers, {**info, "command": ["mine.py"]}, tmp_path) == []
    assert further_runs(answers, info, None) == []
    longer = further_runs(answers, {**info, "n_seeds": 1000}, tmp_path)[0][1]
    assert shlex.split(longer)[-2:] == ["-n", "2000"]


def test_options_are_left_out_in_every_spelling():
    words = ["-n5", "--runs", "3", "--out=x", "--vary", "n=1:2", "--vary=m=1:2", "mission"]
    assert without(words, ("-n", "--runs", "--out"), ["n"]) == ["--vary", "m=1:2", "mission"]
