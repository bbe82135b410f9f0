"""Runs side by side: what comes of each does not depend on the others, whatever they do."""

from __future__ import annotations

import time
from math import inf, nan

import gambles
import numpy as np
import pytest
from gambles import game

from tussle import Block, Mission, Simulation
from tussle.api import Autonomy, EasyMetric, Handle, Metric
from tussle.batch import Batch, InProcess, load_batch
from tussle.batch.stack import play, stack_size
from tussle.batch.tasks import BatchRun, Finished, Heartbeat
from tussle.stock import Still

BAD = (2, 7)
"""Runs of the bad seeds 3 and 8, where run r has seed r + 1."""


def finished(mission, n=12, size=5, params=None):
    """What comes of n runs with seeds 1 to n, by number, but for what may differ."""
    waiting = [BatchRun(i, 0, i + 1, {} if params is None else params[i]) for i in range(n)]

    def take(k):
        taken = waiting[:k]
        del waiting[:k]
        return taken

    found = [f for f in play(mission, take, size) if isinstance(f, Finished)]
    assert len(found) == n
    return {f.number: plain(f) for f in found}


def plain(f):
    """A finished run without what it cost, NaN as None."""
    metrics = sorted((team or 0, name, None if value != value else value) for team, name, value in f.metrics)
    return f.end, f.t, f.steps, f.winner, f.state_hash, f.error, metrics, sorted(f.alive)


@pytest.fixture(scope="module")
def alone():
    """The runs, each by itself."""
    return finished(game(), size=1)


@pytest.mark.parametrize("size", [2, 5, 12, 64])
def test_a_run_comes_out_as_it_does_alone(alone, size):
    assert finished(game(), size=size) == alone


def test_a_run_is_what_its_simulation_comes_to(alone):
    for number, run in alone.items():
        with Simulation(game(), number + 1) as simulation:
            result = simulation.run()[0]
        end, t, steps, winner, state_hash, error, metrics, _ = run
        assert (end, t, steps, winner, state_hash, error) == (
            result.end, result.t, result.steps, result.winner, result.state_hash, "",
        )  # fmt: skip
        assert {(team, name): value for team, name, value in metrics} == {
            **{(team, "score"): v for team, v in result.scores.items()},
            **{(team, "alive"): v for team, v in result.alive.items()},
            **{(team, "Chips.score"): v for team, v in result.metrics["Chips"]["score"].items()},
            (0, "Chips.steps"): result.metrics["Chips"]["steps"],
            (1, "start"): 4.0,
            (2, "start"): 3.0,
        }


def test_the_number_alive_is_kept_from_start_to_end(alone):
    for number, (_, t_end, *_, alive) in alone.items():
        counts = {}
        with Simulation(game(), number + 1) as simulation:
            while simulation.state.n_running:
                bodies = simulation.state.population.bodies
                for team in (1, 2):
                    counts.setdefault(team, []).append(
                        (float(simulation.t[0]), int((bodies.team == team).sum()))
                    )
                simulation.step()
            left = simulation.result()[0].alive
        for team, every in counts.items():
            changes = [c for i, c in enumerate(every) if i == 0 or c[1] != every[i - 1][1]]
            assert [(t, n) for of, t, n in alive if of == team] == [*changes, (t_end, left[team])]


def test_values_of_their_own_make_runs_differ(alone):
    odds = [0.05 * i for i in range(12)]
    params = [{"Roulette.odds": o, "Roulette.harm": (o, 2 * o), "reds.health": 1.0 + o} for o in odds]
    together = finished(game(), params=params)
    assert together == finished(game(), size=1, params=params)
    for i, o in enumerate(odds):
        mission = game(odds=o, harm=(o, 2 * o))
        reds = mission.blocks[0].replace(health=1.0 + o)
        with Simulation(mission.replace(blocks=[reds, mission.blocks[1]]), i + 1) as simulation:
            assert simulation.run()[0].state_hash == together[i][4]


@pytest.mark.parametrize(
    ("trouble", "error"),
    [
        ({"how": "step"}, "Trouble, step 2: gambles.py:{line}: RuntimeError: this seed goes wrong"),
        ({"how": "start"}, "Trouble, step 0: gambles.py:{line}: RuntimeError: this seed cannot begin"),
        ({"how": "result"}, "RuntimeError: this seed has no result"),
        ({"how": "nan"}, "Trouble, reds 1, step 2: w.move: pos is not finite"),
        ({"how": "leave"}, "SystemExit: this seed leaves"),
        ({"mood": "spawn"}, "Nervous, reds, step 0: gambles.py:{line}: RuntimeError: it does not want to"),
        ({"mood": "open"}, "Nervous, reds 1, step 0: gambles.py:{line}: RuntimeError: nobody answers"),
        ({"mood": "part"}, "Nervous, reds 1, step 1: it parts from itself"),
        ({"mood": "decide"}, "Nervous, reds, step 1: gambles.py:{line}: RuntimeError: it cannot decide"),
    ],
    ids=lambda v: "-".join(f"{k}-{w}" for k, w in v.items()) if isinstance(v, dict) else "",
)
def test_a_run_that_fails_is_told_and_leaves_the_others_alone(alone, trouble, error):
    runs = [finished(game(**trouble), size=size) for size in (1, 5, 12)]
    assert runs[0] == runs[1] == runs[2]
    for number, run in runs[0].items():
        if number in BAD:
            assert (run[0], run[3]) == ("error", None)
            line = next((i for i, text in lines() if error.rpartition(": ")[2] in text), 0)
            assert error.format(line=line) in run[5]
        else:
            assert run == alone[number]


def lines():
    return enumerate(gambles.THIS.read_text().splitlines(), 1)


def test_a_run_that_fails_is_told_at_once_and_not_when_its_stack_is_over():
    waiting = [BatchRun(i, 0, i + 1) for i in range(12)]
    order = [
        f.number
        for f in play(game(how="step"), lambda k: [waiting.pop(0) for _ in range(min(k, len(waiting)))], 3)
        if isinstance(f, Finished)
    ]
    assert order.index(2) < 6


@pytest.mark.parametrize(
    ("trouble", "sizes"),
    [
        ({"how": "nan"}, [4]),  # ends its own world only
        ({"mood": "part"}, [4]),
        ({"mood": "open"}, [4]),
        ({"how": "step"}, [4, 1, 1, 1, 1, 2]),  # each run of its stack is played alone
        ({"how": "start"}, [4, 1, 1, 1, 1, 2]),
    ],
)
def test_what_raises_costs_its_stack_and_what_belongs_to_a_run_costs_nobody(monkeypatch, trouble, sizes):
    seen = []

    class Watched(Simulation):
        def __init__(self, mission, seeds, *args, **kwargs):
            seen.append(len(seeds))
            super().__init__(mission, seeds, *args, **kwargs)

    monkeypatch.setattr("tussle.batch.stack.Simulation", Watched)
    runs = finished(game(**trouble, odds=0.0), n=6, size=4)
    assert [number for number, run in runs.items() if run[5]] == [2]
    assert seen == sizes


def test_a_game_that_is_over_at_once_is_kept():
    run = finished(game(end=0.1), n=1)[0]
    assert run[:3] == ("time", 0.1, 1)
    nobody = Mission(
        blocks=[Block(name="b", count=0, motion=Still())], end=0.2, end_conditions="all_dead, time"
    )
    assert finished(nobody, n=2)[1][0] == "all_dead"


def test_a_result_that_is_no_number_is_the_error_of_its_run():
    run = finished(game(how="word"), n=1)[0]
    assert "Trouble.result: 'word' = np.str_('said') is not allowed; it takes numbers" in run[5]
    assert run[6] == finished(game(), n=1)[0][6]


class Lonely(Autonomy):
    link = Handle(max_worlds=2)
    other = Handle(max_worlds=9)

    def open_one(self, row):
        return row.id

    def step(self, g):
        pass


def test_a_stack_is_no_larger_than_its_plugins_allow():
    mission = game()
    mission = mission.replace(blocks=[mission.blocks[0].replace(autonomy=Lonely()), mission.blocks[1]])
    assert stack_size(mission) == 2
    assert all(run[0] != "error" for run in finished(mission, n=5, size=64).values())


def test_signs_of_life_tell_how_much_of_the_games_is_played():
    slow = Mission(blocks=[Block(name="b", motion=Still())], dt=0.1, end=1.0, metrics=[Slow()])
    beats = [m for m in play(slow, take_two(), 2) if isinstance(m, Heartbeat)]
    # On a busy machine one may come when no game is under way any more.
    parts = [b.under_way for b in beats if b.under_way]
    assert parts
    assert parts == sorted(parts)
    assert all(0.0 < p < 2.0 for p in parts)


def take_two():
    waiting = [BatchRun(0, 0, 1), BatchRun(1, 0, 2)]
    return lambda n: [waiting.pop() for _ in range(min(n, len(waiting)))]


class Slow(Metric):
    def step(self, w):
        time.sleep(0.1)


def test_the_cpu_time_of_a_stack_is_shared_among_its_runs():
    class Busy(Metric):
        def step(self, w):
            until = time.process_time() + 0.01
            while time.process_time() < until:
                pass

    mission = Mission(blocks=[Block(name="b", motion=Still())], dt=0.1, end=1.0, metrics=[Busy()])
    waiting = [BatchRun(i, 0, i) for i in range(8)]
    before = time.process_time()
    found = list(play(mission, lambda n: [waiting.pop() for _ in range(min(n, len(waiting)))], 4))
    spent = time.process_time() - before
    shares = np.array([f.cpu_s for f in found if isinstance(f, Finished)])
    assert shares.sum() == pytest.approx(spent, rel=0.2)
    # Two stacks of ten steps, each a hundredth of a second for four worlds.
    assert shares.min() > 0.02


class Odd(EasyMetric):
    """Numbers of any size, and a long name."""

    def result_one(self, w):
        return {"large": 10**300, "small": -2e300, "fits": 2**64, "none": nan, "x" * 200: 1.0}


def test_metrics_beyond_what_squares_allow_are_infinite_in_a_batch(tmp_path):
    mission = Mission(blocks=[Block(name="a", motion=Still())], metrics=[Odd()], dt=0.1, end=0.2)
    with pytest.warns(RuntimeWarning, match="whose name has 204 characters"):
        Batch(mission, runs=3).play(tmp_path / "batch", executor=InProcess())
    results = load_batch(tmp_path / "batch")
    found = [results.quantity(f"Odd.{name}")[0] for name in ("large", "small", "fits", "none")]
    np.testing.assert_array_equal(found, [inf, -inf, 2.0**64, nan])
    assert [mean.n for mean in results.means(["Odd.large", "Odd.fits"])] == [0, 3]
