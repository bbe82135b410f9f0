"""Studies of a mission: estimates, what is kept and goes on, failing games that play again, and what is refused."""

from __future__ import annotations

import json
import math
import shutil
from pathlib import Path

import numpy as np
import pytest

from tussle import Simulation
from tussle.batch import Processes
from tussle.errors import BatchError, ParameterError
from tussle.mission import read_mission
from tussle.stress import Monitor, Specification, Stress, StressGame
from tussle.stress.games import GamePlayer

EXAMPLE = Path(__file__).parents[3] / "examples/stress"
PLUGIN = EXAMPLE / "hover.py"
TEXT = "always (distance(left, right) > 3 m)"


def study(text=TEXT, **more):
    return Stress(EXAMPLE / "pads.xml", text, plugin_files=[PLUGIN], settings={"run.end": 6}, **more)


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """A probability in a directory, and the study."""
    path = tmp_path_factory.mktemp("study") / "out"
    one = study()
    return one, one.probability(20, 6, directory=path), path


def test_splitting_agrees_with_plain_games(found):
    """Each within the other's interval or nearly: a looser test than those with closed forms, on a real mission."""
    _, result, _ = found
    sample = study().sample(3000)
    assert sample.low < result.high
    assert result.low < sample.high
    assert 0.0 < result.value < 0.1
    assert result.n_games < 6 * 20 * 12
    assert math.isfinite(result.n_plain)


PLAIN = (37, 375_000)
"""Failures and games of `tussle stress examples/stress/pads.xml --plugin-path examples/stress/hover.py --seed 1000000 -n 375000
--spec "always (distance(left, right) > 2 m)"`, played once."""


@pytest.mark.slow
def test_splitting_agrees_with_very_many_plain_games():
    one = Stress(EXAMPLE / "pads.xml", "always (distance(left, right) > 2 m)", plugin_files=[PLUGIN])
    result = one.probability(100, 20)
    failures, games = PLAIN
    error = math.hypot((result.high - result.low) / 4.0, math.sqrt(failures) / games)
    assert abs(result.value - failures / games) < 3.0 * error
    assert error < 0.4 * result.value


def test_the_same_in_any_stack_and_process(found):
    one, result, _ = found
    again = study().probability(20, 6, stack=3)
    assert [r.probability for r in again.repetitions] == [r.probability for r in result.repetitions]
    games = [*(p.game for p in result.failures[:3]), StressGame(1), StressGame(2)]
    played = {}
    for how in ({"stack": 1}, {"stack": 5}, {"executor": Processes(2, 2)}):
        for p in GamePlayer(one.batch, one.watching, **how).play(games):
            assert played.setdefault(p.game, (p.verdict, p.state_hash)) == (p.verdict, p.state_hash)


def test_a_failing_branch_is_a_mission_that_fails_when_it_is_played(found):
    _, result, path = found
    listed = json.loads((path / "result.json").read_text())["failures"]
    assert len(listed) == min(10, len(result.failures))
    assert any(p.game.rekeys for p in result.failures)
    for entry in listed[:4]:
        loaded = read_mission(path / entry["file"], plugin_files=[PLUGIN])
        sim = Simulation(loaded.mission, loaded.seed)
        monitor = Monitor(Specification.parse(TEXT, loaded.mission), sim)
        (played,) = sim.run()
        assert played.state_hash == entry["state_hash"]
        assert monitor.robustness()[0] == entry["robustness"] < 0.0


def test_a_study_that_was_killed_goes_on(found, tmp_path):
    """Whatever was written when it was killed, also half a line."""
    _, result, path = found
    copy = tmp_path / "out"
    whole = (path / "games.jsonl").read_text()
    for cut in (0, 777, len(whole) // 2, len(whole) - 3):
        shutil.copytree(path, copy)
        (copy / "games.jsonl").write_text(whole[:cut])
        n = 0

        def count(_):
            nonlocal n
            n += 1

        again = study().probability(20, 6, directory=copy, on_game=count)
        assert n == whole.count("\n") - whole[:cut].count("\n")
        assert [r.probability for r in again.repetitions] == [r.probability for r in result.repetitions]
        assert sorted(
            json.loads(line)["game"] for line in (copy / "games.jsonl").read_text().splitlines()
        ) == sorted(json.loads(line)["game"] for line in whole.splitlines())
        shutil.rmtree(copy)


def test_a_directory_of_something_else_is_refused(found, tmp_path):
    _, _, path = found
    with pytest.raises(BatchError, match="holds another study, which differs in specification"):
        study("always (distance(left, right) > 4 m)").sample(5, directory=path)
    (tmp_path / "note.txt").write_text("mine")
    with pytest.raises(BatchError, match="holds something that is no study"):
        study().sample(5, directory=tmp_path)
    copy = tmp_path / "copy"
    shutil.copytree(path, copy)
    lines = (copy / "games.jsonl").read_text().splitlines()
    for wrong in (
        "{}",
        "[1]",
        '{"game": "x"',
        *(lines[0].replace('"levels": [', f'"levels": [{text}') for text in ('"a", ', '"1e9", ')),
    ):
        (copy / "games.jsonl").write_text("\n".join([lines[0], wrong, ""]))
        with pytest.raises(BatchError, match="line 2 is damaged"):
            study().sample(5, directory=copy)


def test_a_game_is_lost_little_by_little(found):
    """From the start a failure is as rare as it is; from the moment of the failure on, it is sure."""
    one, result, _ = found
    lost = one.chances(result.failures[0], 5, 40)
    assert lost[0].step == 0
    assert lost[-1].step == result.failures[0].verdict.first_below(0.0)
    assert (lost[-1].value, lost[-1].n) == (1.0, 40)
    assert lost[0].value < 0.3
    assert all(each.low <= each.value <= each.high for each in lost)
    assert one.chances(result.failures[0], 5, 40, stack=7) == lost
    good = next(p for p in one.sample(30).games if not p.verdict.has_failed)
    with pytest.raises(ParameterError, match="did not fail, so nothing is to be explained"):
        one.chances(good)


def test_a_game_that_fails_with_an_error_is_no_failure_of_the_specification():
    with pytest.raises(BatchError, match=r"the game with seed \d+ failed"):
        study(
            "max_speed(all) / (2 - time) < 1 or always (once() > 0)", functions={"once": late_error}
        ).sample(3)


def late_error(sim):
    """NaN from one second on."""
    return np.where(sim.t < 1.0, 1.0, np.nan)


def test_what_has_no_answer_is_said_in_one_sentence():
    with pytest.raises(ParameterError, match="there is no 'scores"):
        study("scores[2] > 3").sample(3)
    with pytest.raises(ParameterError, match="replaced = 0"):
        study().probability(replaced=0.0)
    calm = Stress(
        EXAMPLE / "pads.xml", TEXT, plugin_files=[PLUGIN],
        settings={"run.end": 2, "left.Hover.gust": 0, "right.Hover.gust": 0},
    )  # fmt: skip
    with pytest.raises(ParameterError, match="the mission has no randomness"):
        calm.probability(4, 2)


def test_a_guide_finds_the_same_probability(found):
    guide = "always (approach(left, right, 1 m/s) > 3 m)"
    guided = study(guide=guide)
    other = guided.probability(20, 6)
    assert other.low < found[1].value < other.high
    assert guided.info["guide"] == guide
    assert guided.info["fingerprint"] != found[0].info["fingerprint"]
    worst = other.failures[0]
    assert worst.verdict.robustness == worst.verdict.score < 0.0
    (again,) = GamePlayer(found[0].batch, found[0].watching, processes=1).play([worst.game])
    assert again.verdict.robustness == worst.verdict.robustness
    assert again.verdict.first_below(0.0) == worst.verdict.first_below(0.0)


def test_moves_to_other_starts_are_games_like_all_others(tmp_path):
    """The same in any stack and after a kill; a failing one is a mission that fails, with its start in the file."""
    where = {"left.variance_y": 9, "left.use_variance_all_ents": True}
    one = Stress(EXAMPLE / "pads.xml", TEXT, plugin_files=[PLUGIN], settings={"run.end": 3, **where})
    result = one.probability(16, 2, redraws=1, directory=tmp_path / "out")
    games = tmp_path / "out/games.jsonl"
    whole = games.read_text()
    assert "left/1/birth" in whole
    games.write_text(whole[: len(whole) // 2])
    again = one.probability(16, 2, redraws=1, directory=tmp_path / "out", stack=3)
    for a, b in zip(again.repetitions, result.repetitions, strict=True):
        assert (a.probability, a.levels, [p.game for p in a.failures]) == (
            b.probability,
            b.levels,
            [p.game for p in b.failures],
        )
    assert len(games.read_text().splitlines()) == whole.count("\n")
    moved = next(p.game for p in result.failures if any("birth" in str(r) for r in p.game.rekeys))
    file = tmp_path / "moved.xml"
    file.write_text(one.failing_mission(moved))
    loaded = read_mission(file, plugin_files=[PLUGIN])
    sim = Simulation(loaded.mission, loaded.seed)
    monitor = Monitor(Specification.parse(TEXT, loaded.mission), sim)
    sim.run()
    assert monitor.robustness()[0] < 0.0
    assert result.n_games == sum(r.n_games for r in [*result.before, *result.repetitions])


def test_a_guide_of_the_end_alone_or_of_a_search_is_of_no_use():
    late = study(guide="lost[1] < 1").probability(4, 2)
    assert "nothing is known of this specification before a game ends" in late.notes[0]
    with pytest.raises(ParameterError, match="did you mean 'approach'"):
        study(guide="always (aproach(left, right, 1 m/s) > 3 m)")
    with pytest.raises(ParameterError, match="a guide is for"):
        study(guide=TEXT, vary={"left.Hover.gain": (0.3, 1)}).search(10)


def test_notes_say_where_the_result_is_weak():
    late = study("eventually[0,5] (distance(left, right) > 40 m)").probability(6, 2)
    assert (late.value, late.low, late.high) == (1.0, 1.0, 1.0)
    assert "nothing is known of this specification before a game ends" in late.notes[0]
    never = study("always (distance(left, right) > 0.00001 m) and always (time < 100)").probability(4, 2)
    assert never.value == 0.0
    assert 0.2 < never.high < 0.5
    assert any("no game failed in any repetition" in note for note in never.notes)
