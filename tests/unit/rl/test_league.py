"""A league plays each against each, rates the players, and can be continued."""

from __future__ import annotations

import math

import pytest

pytest.importorskip("onnx", reason="onnx is not installed: pip install 'tussle[policy]'")
pytest.importorskip("onnxruntime", reason="onnxruntime is not installed: pip install 'tussle[policy]'")

from leagues import chase_league, constant

from tussle.batch.executors import InProcess
from tussle.errors import BatchError, ParameterError
from tussle.plugins.stock.autonomy.learned import policy_path
from tussle.rl import Battle
from tussle.rl.flight import load_flight
from tussle.rl.league import League, Pairing, ratings_of
from tussle.rl.opponents import other_side


def pairing(a, b, wins, draws, losses):
    return Pairing(a, b, wins, draws, losses, 0.0, 0.0, 0.0, 0, "", 0.0)


def test_ratings_of_two_players_are_their_odds():
    best, worst = ratings_of(["a", "b"], [pairing("a", "b", 30, 0, 10)])
    odds = math.log(30.5 / 10.5)
    assert best.elo - worst.elo == pytest.approx(400.0 / math.log(10.0) * odds, rel=1e-6)
    assert best.elo == pytest.approx(-worst.elo)
    half = 0.5 * 400.0 / math.log(10.0) * 1.959964 * math.sqrt(1 / 30.5 + 1 / 10.5)
    assert (best.low, best.high) == pytest.approx((best.elo - half, best.elo + half), rel=1e-4)
    assert (worst.wins, worst.draws, worst.losses) == (10, 0, 30)


def test_draws_are_half_wins_and_who_wins_all_games_has_a_rating():
    drawn, won = (
        ratings_of(["a", "b"], [pairing("a", "b", 10, 20, 10)]),
        ratings_of(["a", "b"], [pairing("a", "b", 40, 0, 0)]),
    )
    assert [r.elo for r in drawn] == pytest.approx([0.0, 0.0], abs=1e-9)
    assert 300.0 < won[0].elo < 500.0
    assert won[0].high - won[0].low > drawn[0].high - drawn[0].low


def test_three_players_are_rated_by_all_games():
    results = [pairing("a", "b", 30, 0, 10), pairing("b", "c", 30, 0, 10)]
    a, b, c = ratings_of(["c", "b", "a"], results)
    assert [r.name for r in (a, b, c)] == ["a", "b", "c"]
    assert (a.elo + c.elo, b.elo) == pytest.approx((0.0, 0.0), abs=1e-6)


@pytest.fixture(scope="module")
def policies(tmp_path_factory):
    folder = tmp_path_factory.mktemp("policies")
    return constant(folder / "still.onnx", -1.0), constant(folder / "circles" / "policy.onnx", 1.0, 1.0)


def test_predators_beat_policies_that_catch_nobody(policies):
    still, circles = policies
    league = chase_league("rules", still, circles, games=6, seed=5)
    assert [league.batch.plan.seed(run) for run in (0, 1, 2)] == [5, 6, 7]
    standings = league.standings(league.batch.play(executor=InProcess(3)))
    assert standings.ratings[0].name == "rules"
    assert [(p.a, p.b) for p in standings.pairings] == [
        ("rules", "still"),
        ("rules", "circles"),
        ("still", "circles"),
    ]
    assert [(p.wins, p.draws, p.losses) for p in standings.pairings] == [(6, 0, 0), (6, 0, 0), (0, 6, 0)]
    won, _, drawn = standings.pairings
    assert won.decider == 7  # the fourth of its games, which are the first two in each round of six
    assert won.margin >= 1
    assert drawn.share == 0.5
    assert drawn.low < 0.5 < drawn.high
    alone = league.standings(league.batch.play(executor=InProcess(1)))
    assert alone == standings


def test_the_deciding_game_is_the_one_after_which_nobody_can_catch_up(policies):
    import numpy as np

    league = chase_league("rules", policies[0], games=6)
    runs = np.arange(6)
    found = league._pairing(
        ("rules", "still"), runs, runs % 2 == 1, np.array([1.0, -2.0, 1.0, 0.0, 3.0, 5.0])
    )
    assert (found.wins, found.draws, found.losses, found.decider, found.sides, found.margin) == (
        4,
        1,
        1,
        4,
        "red",
        3.0,
    )
    even = league._pairing(
        ("rules", "still"), runs, runs % 2 == 1, np.array([1.0, -2.0, 1.0, -1.0, 3.0, -5.0])
    )
    assert (even.share, even.decider, even.sides) == (0.5, 5, "blue")


def test_two_sides_have_players_of_their_own(tmp_path):
    prey = constant(tmp_path / "stand.onnx", -1.0, task="test/Flee-v0", width=3)
    hunters = constant(tmp_path / "rest.onnx", -1.0, task="test/Hunt-v0")
    league = chase_league("rules", prey, hunters, task="test/Flee-v0", games=3)
    assert league.pairs == [
        ("rules of prey", "rules of hunters"), ("rules of prey", "rest"), ("stand", "rules of hunters"), ("stand", "rest"),
    ]  # fmt: skip
    standings = league.standings(league.batch.play(executor=InProcess()))
    results = {(p.a, p.b): (p.wins, p.draws, p.losses) for p in standings.pairings}
    assert results["stand", "rules of hunters"] == (0, 0, 3)
    assert results["stand", "rest"] == (3, 0, 0)
    with pytest.raises(
        ParameterError, match=r"there is no game with the players stand; prey and hunters need one each"
    ):
        chase_league(prey, task="test/Flee-v0")


def test_a_killed_league_goes_on(policies, tmp_path):
    def stop(progress):
        if progress.n_done >= 4:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        chase_league("rules", *policies, games=4).batch.play(tmp_path, InProcess(2), on_progress=stop)
    league, counts = chase_league("rules", *policies, games=4), []
    results = league.batch.play(
        tmp_path, InProcess(2), on_progress=lambda progress: counts.append(progress.n_before)
    )
    assert 4 <= counts[0] < 12
    assert league.standings(results) == league.standings(league.batch.play(executor=InProcess()))


def test_another_file_is_another_league(tmp_path):
    still = constant(tmp_path / "still.onnx", -1.0)
    chase_league("rules", still, games=2).batch.play(tmp_path / "out", InProcess())
    constant(still, 1.0)
    with pytest.raises(BatchError):
        chase_league("rules", still, games=2).batch.play(tmp_path / "out", InProcess())


def test_wrong_players_are_refused(policies, tmp_path):
    still, circles = policies
    for players, message in (
        (["rule", still], r"did you mean 'rules'.*there is no file rule; it takes rules, an ONNX file, NAME=rules or NAME=FILE"),
        ([still, f"still={circles}"], r"player 'still' is there twice; each has a name of its own, such as late="),
        (["rules"], r"there is no game with the players rules"),
        ([constant(tmp_path / "prey.onnx", 0.0, task="test/Flee-v0")], r"plays test/Flee-v0; this league takes policies of"),
        (["rules", constant(tmp_path / "wide.onnx", 0.0, width=12)], r"takes 12 and returns 2 numbers; agents of test/Chase-v0 observe 11"),
    ):  # fmt: skip
        with pytest.raises(ParameterError, match=message):
            chase_league(*players)
    with pytest.raises(
        ParameterError,
        match=r"tussle/Hover-v0 has no other side.*there are: tussle/Battle-v0, tussle/BattleBlue-v0",
    ):
        League("tussle/Hover-v0", ["rules"])
    with pytest.raises(ParameterError, match="did you mean 'tussle/Battle-v0'"):
        League("tussle/Batle-v0", ["rules"])


def test_the_advice_of_errors_can_be_followed(policies):
    """Each error tells what to give instead: that is accepted."""
    for players in (["rules", "rules"], ["rules", policies[0], policies[0]]):
        with pytest.raises(ParameterError, match="is there twice") as refused:
            chase_league(*players)
        advice = str(refused.value).rpartition("such as ")[2]
        assert "late" in chase_league(*players[:-1], advice).players
    league = chase_league("rules", "again=rules", task="test/Flee-v0")
    assert league.pairs[1] == ("rules of prey", "again of hunters")
    with pytest.raises(ParameterError, match="there is no game with the players rules; a game has two"):
        chase_league("rules")


@pytest.mark.parametrize("name", ["Battle", "tussle/battle-v0", "Battle-v0", "tussle/Batle-v0", "battle"])
def test_a_misspelt_task_is_reported_where_it_is_named(name):
    near = r": there is no task .* \(did you mean 'tussle/Battle-v0'\?\)"
    with pytest.raises(ParameterError, match=f"^TASK{near}"):
        League(name, ["rules"])
    with pytest.raises(ParameterError, match=f"^Learned.task{near}"):
        load_flight(policy_path("predator_team"), name, "")
    with pytest.raises(ParameterError, match=f"^Battle.opponents of tussle/Battle-v0{near}"):
        other_side("tussle/Battle-v0", Battle(opponents=name))
