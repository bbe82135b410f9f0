"""Games that take longer than they may are given up, and the batch goes on."""

from __future__ import annotations

import multiprocessing

import pytest
from gambles import game, rows

from tussle.batch import Batch, InProcess, OnDask, Processes, optimize
from tussle.batch import batch as batches
from tussle.errors import ParameterError

LIMIT = 8.0
"""A game takes milliseconds, and the first of a process half a second for its kernels; a slow machine needs more [s]."""
SOON = 1.0
"""For games that never end, on whatever machine [s]."""


def errors_of(results):
    return {row["seed"]: row["error"] for row in results.failed().to_pylist()}


@pytest.mark.slow
def test_a_plugin_that_does_not_return_costs_its_own_run_only():
    batch = Batch(game(how="sleep"), runs=6, first_seed=1, run_timeout=LIMIT)
    results = batch.play(executor=Processes(1, 6))
    assert errors_of(results) == {3: "it took longer than the 8.0 s that a run may"}
    clean = Batch(game(), runs=6, first_seed=1).play(executor=InProcess())
    others, expected = ([row for row in rows(r)[0] if row["seed"] != 3] for r in (results, clean))
    assert others == expected
    assert not multiprocessing.active_children()


def test_a_game_without_end_is_given_up_though_its_steps_are_short():
    endless = game().replace(end_conditions=("none",))
    results = Batch(endless, runs=2, run_timeout=SOON).play(executor=InProcess(1))
    assert list(errors_of(results).values()) == ["it took longer than the 1.0 s that a run may"] * 2


def test_what_hangs_in_its_first_steps_does_not_hold_the_command(monkeypatch):
    monkeypatch.setattr(batches, "STARTS_WITHIN", 0.0)
    batch = Batch(game(how="sleep", at=0), runs=1, first_seed=3, run_timeout=SOON)
    assert set(errors_of(batch.play(until="score[1]±0.5"))) == {3}
    assert not multiprocessing.active_children()


def test_a_search_gives_games_up(monkeypatch):
    monkeypatch.setattr(batches, "STARTS_WITHIN", 0.0)
    study = optimize(
        game(how="sleep", at=0),
        "t",
        vary={"run.dt": (0.1, 0.2)},
        trials=1,
        runs=1,
        first_seed=3,
        run_timeout=SOON,
    )
    assert "it took longer" in study.trials[0].error


@pytest.mark.parametrize("value", [0.0, -1.0, float("nan"), float("inf")])
def test_a_limit_is_a_time(value):
    with pytest.raises(ParameterError, match="it takes a number > 0"):
        Batch(game(), run_timeout=value)


def test_a_cluster_has_limits_of_its_own():
    class Client:
        asynchronous = False

    batch = Batch(game(), runs=1, run_timeout=1.0)
    with pytest.raises(ParameterError, match="run_timeout is for processes of this machine"):
        next(OnDask(Client()).play(batch.package, [batch.run(0)]))
