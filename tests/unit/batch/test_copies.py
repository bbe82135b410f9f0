"""Runs are copies of one game only if nothing in them depends on the seed, however alike they end."""

from __future__ import annotations

import numpy as np
import pytest
from gambles import Roulette

from tussle import Block, Mission
from tussle.api import Autonomy, Interaction, Metric
from tussle.batch import Batch, Choice, InProcess
from tussle.batch.statistics import wilson
from tussle.stock import Still


class Ends(Interaction):
    """Removes everybody at once, so that all games end in one state."""

    def step(self, w):
        w.kill(np.arange(w.n), "over")


class ReadsSeeds(Metric):
    def result(self, w):
        return {"unlikely": (w.seeds > 1e15).astype(float)}


class Draws(Autonomy):
    def step(self, g):
        g.normal("unused")


class Share(Metric):
    def result(self, w):
        return {"hit": np.zeros(w.n_worlds)}


def mission(*, interactions=(), metrics=(), update="synchronous", **block):
    block = {"count": 3, "position": (0, 0, 10), "variance": (0, 0, 0), "motion": Still()} | block
    ends = Ends()
    return Mission(
        name="alike", blocks=[Block(name="A", **block)], dt=0.1, end=0.5, update=update,
        end_conditions=("time",), interactions=[*interactions, ends], metrics=metrics,
    )  # fmt: skip


SOURCES = {
    "none": (mission(), True),
    "the place of one that is not scattered": (mission(count=1, variance=(9, 9, 0)), True),
    "births at a steady rate": (mission(rate=9.0), True),
    "places": (mission(variance=(9, 9, 0)), False),
    "places in a box": (mission(placement="uniform", half_width=(9, 9, 0)), False),
    "headings": (mission(count=1, heading_variance=0.1), False),
    "times of births": (mission(rate=9.0, interval_sd=0.001), False),
    "a draw of an interaction": (mission(interactions=[Roulette(odds=0.0)]), False),
    "a draw of an autonomy": (mission(autonomy=Draws()), False),
    "seeds": (mission(metrics=[ReadsSeeds()]), False),
    "the order of moves": (mission(update="random"), False),
}


@pytest.mark.parametrize("source", SOURCES)
def test_runs_are_copies_only_if_nothing_depends_on_the_seed(source):
    played, are_copies = SOURCES[source]
    results = Batch(played, runs=5).play(executor=InProcess())
    assert results.n_distinct == (1 if are_copies else 5)
    assert bool(results.notes) == are_copies


def test_an_event_that_happened_in_no_game_has_an_interval():
    game = mission(interactions=[Roulette(odds=0.0)], metrics=[Share()])
    (mean,) = Batch(game, runs=20).play(executor=InProcess()).means(["Share.hit"])
    assert (mean.low, mean.high) == wilson(0, 20)


def test_points_without_chance_are_copies_beside_others():
    vary = [Choice("A.variance", ("0 0 0", "9 9 0"))]
    assert Batch(mission(), vary=vary, runs=5).play(executor=InProcess()).n_distinct == 1 + 5


def test_points_whose_plugins_do_not_draw_are_copies_beside_others_whose_do():
    vary = [Choice("draws", (False, True))]
    one = Batch(lambda draws: mission(autonomy=Draws()) if draws else mission(), vary=vary, runs=5)
    assert one.play(executor=InProcess()).n_distinct == 1 + 5
