"""When a batch stops by what it finds: always at the same run, and with nothing lost that was asked for."""

from __future__ import annotations

import gambles
import numpy as np
import pytest
from gambles import counted, game, rows

from tussle.api import Metric
from tussle.batch import Batch, InProcess
from tussle.batch.stopping import ROUND, quantities_of
from tussle.batch.tasks import Finished
from tussle.errors import ParameterError

PLUGINS = {"plugin_files": [gambles.THIS]}


@pytest.fixture
def mission(tmp_path):
    file = tmp_path / "game.xml"
    file.write_text(gambles.MISSION)
    return file


def until_batch(mission, runs=None, **more):
    return Batch(mission, runs=runs, vary=["reds=3,4"], **PLUGINS, **more)


class Enough(Exception):
    pass


@pytest.mark.parametrize("rule", ["score[1]:0.6", "0.2", "lost[2]:0.3"])
def test_where_a_batch_stops_does_not_depend_on_who_plays_nor_on_interruptions(mission, tmp_path, rule):
    reference = until_batch(mission).play(tmp_path / "reference", InProcess(1), until=rule)
    n = reference.info["n_seeds"]
    assert reference.info["stopped_by"] == reference.info["until"] == rule
    assert 20 <= n < 500
    assert n % ROUND == 0
    assert reference.n_runs == reference.n_planned == 2 * n
    # It is the first round with which it is enough.
    name = rule.rpartition(":")[0] or "wins[1]"
    half, width = (_widths(reference, name, k) for k in (n - ROUND, n))
    wanted = float(rule.rpartition(":")[2])
    assert width <= wanted * 1.0000001
    assert n == 20 or half > wanted or rule == "0.2"
    assert rows(until_batch(mission).play(executor=InProcess(64), until=rule)) == rows(reference)

    def watch(progress):
        if progress.n_done - progress.n_before >= 71:
            raise Enough

    path = tmp_path / "out"
    for _ in range(1000):
        try:
            results = until_batch(mission).play(path, InProcess(13), until=rule, on_progress=watch)
            break
        except Enough:
            pass
    assert rows(results) == rows(reference)


def _widths(results, name, n_seeds):
    """Half the widest of the intervals of a mean at the points, with so many seeds."""
    matrix = results.by_seed(name)[:n_seeds]
    return max(1.96 * matrix.std(axis=0, ddof=1) / np.sqrt(n_seeds))


def test_a_narrower_rule_goes_on_and_a_wider_one_has_enough(mission, tmp_path):
    path = tmp_path / "out"
    first, n_first = counted(until_batch(mission), path, "score[1]:0.6")
    assert counted(until_batch(mission), path, "score[1]:0.6")[1] == 0
    second, n_second = counted(until_batch(mission), path, "score[1]:0.4")
    assert n_second > 0
    assert second.n_runs > first.n_runs
    assert n_first >= first.n_runs
    assert rows(second) == rows(until_batch(mission).play(executor=InProcess(7), until="score[1]:0.4"))
    third, n_third = counted(until_batch(mission), path, "score[1]:0.6")
    assert (n_third, third.n_runs) == (0, second.n_runs)
    assert third.info["stopped_by"] == "score[1]:0.6"
    # Without a rule, it has as many as are asked for and never fewer than are there.
    n_seeds = second.info["n_seeds"]
    assert counted(until_batch(mission, 5), path)[1] == 0
    more, n_more = counted(until_batch(mission, n_seeds + 2), path)
    assert (n_more, more.info["n_seeds"], more.info["stopped_by"]) == (4, n_seeds + 2, None)


def test_a_rule_drops_nothing_that_was_asked_for_before(mission, tmp_path):
    def batch(runs):
        return Batch(mission, runs=runs, vary=["odds=0.1,0.3"], **PLUGINS)

    path = tmp_path / "out"
    before = batch(60).play(path, InProcess())
    after, n = counted(batch(None), path, "score[1]:0.9")
    assert n == 0
    assert rows(after) == rows(before)

    def watch(progress):
        if progress.n_done >= 87:
            raise Enough

    path = tmp_path / "cut"
    with pytest.raises(Enough):
        batch(60).play(path, InProcess(1), on_progress=watch)
    after, n = counted(batch(None), path, "score[1]:0.9")
    assert (n, after.info["n_seeds"]) == (1, 44)  # the other game of the last seed


def test_a_rule_that_is_not_reached_ends_with_the_runs(mission, tmp_path):
    results = until_batch(mission, 25).play(tmp_path / "out", InProcess(), until="score[1]:0.01")
    assert (results.n_runs, results.info["stopped_by"], results.info["until"]) == (50, None, "score[1]:0.01")
    _, n = counted(until_batch(mission, 30), tmp_path / "out", "score[1]:0.01")
    assert n == 10


def test_runs_that_fail_do_not_hold_up_the_end(mission):
    batch = until_batch(mission, settings={"how": "step"})
    results = batch.play(executor=InProcess(32), until="score[1]:0.6")
    assert results.info["stopped_by"] == "score[1]:0.6"
    assert 0 < results.n_failed < results.n_runs < 1000


def test_a_rule_that_means_nothing_is_told(mission, tmp_path):
    with pytest.raises(ParameterError, match="no number"):
        until_batch(mission).play(tmp_path / "out", until="score[1]")
    for directory in (tmp_path / "out", None):
        with pytest.raises(ParameterError, match=r"there is no 'score\[9\]'"):
            until_batch(mission).play(directory, InProcess(), until="score[9]:0.5")
    assert not (tmp_path / "out").exists()
    unscored = Batch(game().replace(metrics=[]), runs=None)
    with pytest.raises(ParameterError, match="these games have no scores"):
        unscored.play(until="0.1")


class Late(Metric):
    def result(self, w):
        return {"late": w.t} if (w.t > 0.5).all() else {}


def test_a_rule_may_be_about_what_only_whole_games_have():
    batch = Batch(game(odds=0.0).replace(metrics=[Late()]), runs=None)
    results = batch.play(executor=InProcess(), until="Late.late:0.1")
    assert results.info["n_seeds"] == 20


def test_what_a_run_is_asked_for_is_what_results_call_it(mission):
    played = []

    class Watched(InProcess):
        def play(self, package, runs):
            for message in super().play(package, runs):
                if isinstance(message, Finished):
                    played.append(message)
                yield message

    results = Batch(mission, runs=6, settings={"how": "step"}, **PLUGINS).play(executor=Watched())
    for finished in played:
        values = quantities_of(finished)
        for name in results.quantities:
            (value,) = results.quantity(name, [finished.number])
            assert np.array_equal(values.get(name, np.nan), value, equal_nan=True), name
