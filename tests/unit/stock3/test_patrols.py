"""Convoy, Escort and AuctionSearch, by small cases computed by hand."""

from __future__ import annotations

import numpy as np
import pytest
from small_worlds import Drift, block, mission

from tussle import Simulation
from tussle.api import Autonomy, State, Subscribe
from tussle.messages import TextMessage
from tussle.stock import (
    AuctionSearch,
    Convoy,
    Escort,
    GoTo,
    SimpleCapture,
    SingleIntegrator,
    SphereNetwork,
    Still,
)

FREE = SingleIntegrator(max_speed=-1.0)


def radio(reach):
    return SphereNetwork(name="CommsNetwork", range=reach)


# -- Convoy and Escort ------------------------------------------------------------------------------------------------------------


def column(reach, steps):
    """Distances between a leader at 5 m/s and the two vehicles behind it, of which one is removed half way."""
    behind = [Convoy(gap=20.0), GoTo(speed=8.0, slowing_distance=8.0)]
    blocks = [
        block("lead", position=(0, 0, 0), autonomy=[Convoy(), Drift(to=(5.0, 0.0, 0.0))], motion=FREE),
        *(block(f"v{k}", position=(-25.0 * k, 0, 0), autonomy=behind, motion=FREE) for k in (1, 2)),
    ]
    sim = Simulation(mission(*blocks, networks=[radio(reach)], end=60.0))
    sim.step(steps)
    x = [sim.read(f"{name}.pos")[0][0, 0, 0] for name in ("lead", "v1", "v2")]
    return x[0] - x[1], x[1] - x[2], sim.read("v2.Convoy.ahead")[0][0, 0]


def test_vehicles_keep_their_distance_in_a_column():
    """At the leader's 5 m/s a follower is 5 m short of its goal (8 m/s at 8 m), which was 20 m behind the leader one step ago."""
    first, second, ahead = column(1000.0, 300)
    assert first == pytest.approx(
        20.0 + 5.0 + 1.0, abs=0.6
    )  # a step of 0.1 s at the receiver and one at the sender
    assert second == pytest.approx(first, abs=0.1)
    assert ahead == 2


def test_a_vehicle_without_news_goes_to_its_last_goal_and_waits():
    first, second, _ = column(24.0, 300)  # the leader leaves the range of those behind
    assert first > 100.0
    assert second == pytest.approx(25.0, abs=3.0)


def escorts(reach, sight=5.0, steps=60):
    """Position of an escort, and whether an intruder near the second of two vehicles is left."""
    blocks = [
        block("cars", count=2, position=(0, 0, 0), autonomy=Convoy(sight=30.0), motion=Still()),
        block("car", position=(100, 0, 0), autonomy=Convoy(sight=30.0), motion=Still()),
        block("foe", team=2, position=(120, 0, 0), autonomy=Drift(to=(0.0, 0.0, 0.0))),
        block("guard", position=(0, 60, 0), autonomy=[Escort(sight=sight), GoTo(speed=30.0, slowing_distance=0.0)], motion=FREE),
    ]  # fmt: skip
    rules = {"networks": [radio(reach)], "interactions": [SimpleCapture(capture_range=10.0)]}
    sim = Simulation(mission(*blocks, end=60.0, **rules))
    sim.step(steps)
    return sim.read("guard.pos")[0][0, 0], sim.read("foe.pos")[1][0, 0]


def test_an_escort_flies_to_the_intruder_that_it_hears_of_and_returns_to_the_middle():
    pos, is_left = escorts(1000.0)
    assert not is_left
    pos, _ = escorts(1000.0, steps=200)
    assert pos == pytest.approx([100.0 / 3.0, 0.0, 0.0], abs=1.0)  # mean of 0, 0 and 100
    pos, is_left = escorts(70.0)  # it hears the two vehicles at the origin only
    assert is_left
    assert pos == pytest.approx([0.0, 0.0, 0.0], abs=1.0)
    assert not escorts(70.0, sight=200.0)[1]


# -- AuctionSearch ----------------------------------------------------------------------------------------------------------------


class Ear(Autonomy):
    """Counts events."""

    n = State("search done", dtype=int)
    events = Subscribe(TextMessage, network="LocalNetwork", topic="Event")

    def step(self, g):
        rows, heard = self.events.pairs()
        for row, text in zip(rows, heard.text, strict=True):
            self.n[("search", "done").index(text), row] += 1


AREAS = "[10 0 0] [20 0 0] [30 0 0] [0 -40 0]"


def searched(rule="path", reach=1000.0, steps=300, seeds=1):
    """Areas visited by two searchers, and the auctioneer's next area."""
    flies = [AuctionSearch(rule=rule, tolerance=1.0), GoTo(speed=5.0), Ear()]
    blocks = [
        block("head", position=(0, 50, 0), autonomy=[AuctionSearch(areas=AREAS, does_bid=False), Drift(to=(0.0, 0.0, 0.0))]),
        block("east", position=(0, 0, 0), autonomy=flies, motion=FREE),
        block("south", position=(0, -15, 0), autonomy=flies, motion=FREE),
    ]  # fmt: skip
    sim = Simulation(mission(*blocks, networks=[radio(reach)], end=60.0), seeds)
    sim.step(steps)
    n = [sim.read(f"{name}.AuctionSearch.n_visited")[0][:, 0] for name in ("east", "south")]
    events = [sim.read(f"{name}.Ear.n")[0][0, 0].tolist() for name in ("east", "south")]
    return np.array(n).T.tolist(), int(sim.read("head.AuctionSearch.offered")[0][0, 0]), events


def test_areas_go_to_the_lowest_bid():
    """By length of the route: 10 < 18.0, 20 > 25 - ..., so that both get areas; by distance: the one in the east gets three."""
    visited, offered, events = searched()
    assert sum(visited[0]) == offered == 4
    assert min(visited[0]) >= 1
    assert events[0][0] >= 1
    assert events[0][0] == events[0][1]  # each search was done
    assert searched("nearest")[0] == [[3, 1]]
