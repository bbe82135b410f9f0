"""What holds for any rate, delay, and order of births and deaths."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from small_worlds import Drift, Listener, Talker, block, mission

from tussle import Simulation
from tussle.api import Interaction, Param
from tussle.engine.schedule import _rate, is_due
from tussle.errors import ParameterError
from tussle.stock import GlobalNetwork

few = settings(max_examples=25)


@given(
    rate=st.decimals("0.01", "9.99", places=2),
    dt=st.sampled_from(["0.1", "0.025", "0.01"]),
    n=st.integers(1, 5000),
)
def test_calls_up_to_a_step_are_the_floor_of_its_time_times_the_rate(rate, dt, n):
    """The first call is in step 0; after it, as many as whole periods have passed."""
    per_step = Fraction(str(rate)) * Fraction(dt)
    assert (
        int(is_due(np.arange(n + 1), per_step).sum()) == 1 + (n * per_step.numerator) // per_step.denominator
    )


@pytest.mark.parametrize(("rate", "dt", "every"), [(1.0 / 3.0, 0.1, 30), (1e-7 / 3.0, 0.1, 300_000_000)])
def test_a_rate_of_many_digits_holds_to_the_last_step(rate, dt, every):
    """Products of its digits and the number of the step stay within 64 bits."""
    per_step = _rate(Drift(rate=rate), dt)
    for near in (every, 10**9 // every * every):
        steps = np.arange(near - 5, near + 5)
        assert steps[is_due(steps, per_step)].tolist() == [near]


def test_a_rate_that_no_game_lives_to_see_is_refused():
    message = r"Drift: rate = 1e-320 is not allowed with dt = 0.1; it takes at least 1e-08 calls per second"
    with pytest.raises(ParameterError, match=message.replace("1e-320", "9.99989e-321")):
        Simulation(mission(block(autonomy=Drift(rate=1e-320))))


@few
@given(delay=st.floats(0.0, 1.5), said=st.integers(0, 8), seeds=st.integers(1, 3))
def test_a_message_is_read_in_the_first_call_after_its_time_whatever_else_is_said(delay, said, seeds):
    network = GlobalNetwork(name="slow", comm_delay=delay)
    game = mission(
        block("a", autonomy=[Drift(), Talker(first=said, last=said + 1, network="slow")]),
        block("b", autonomy=[Drift(), Listener(network="slow")]),
        networks=[network],
        end=3.0,
    )
    sim = Simulation(game, seeds=range(seeds))
    sim.run()
    steps = max(0, int(np.ceil(delay / 0.1 - 1e-9)))
    assert sim.read("b.Listener.read_in")[0].tolist() == [[said + steps + 1]] * seeds
    assert sim.read("b.Listener.n_heard")[0].tolist() == [[1]] * seeds


class Fate(Interaction):
    """Kill and spawn by a plan: (step, world) -> ids to kill, number to spawn."""

    salt = Param(0, structural=True)

    def step(self, w):
        draws = np.random.default_rng([self.salt, int(w.step_count.max())])
        for world in range(w.n_worlds):
            there = w.id[w.world == world]
            doomed = there[draws.random(len(there)) < 0.3]
            w.kill((w.world == world) & np.isin(w.id, doomed), "fate")
            w.spawn("late", [world] * int(draws.integers(0, 3)), pos=(float(world), 0.0, 0.0))


@few
@given(
    salt=st.integers(0, 10**6),
    n_worlds=st.integers(1, 4),
    counts=st.tuples(st.integers(0, 4), st.integers(0, 4)),
)
def test_rows_stay_ordered_and_ids_are_used_once_whoever_comes_and_goes(salt, n_worlds, counts):
    game = mission(
        block("a", count=counts[0]),
        block("late", count=counts[1], autonomy=[Drift(), Listener()]),
        interactions=[Fate(salt=salt)],
        end_conditions="time",
    )
    sim = Simulation(game, seeds=range(n_worlds))
    last_seen: dict[int, set[int]] = {w: set() for w in range(n_worlds)}
    ever: dict[int, set[int]] = {w: set() for w in range(n_worlds)}

    def look(s):
        bodies = s.population.bodies
        for group in s.population.groups:
            rows = slice(group.first, group.last)
            key = bodies.world[rows] * 10**6 + bodies.id[rows]
            assert (np.diff(key) > 0).all()
            assert group.x.shape[1] == group.n
            assert np.array_equal(group.x[:3], bodies.pos[:, rows])
        for world in range(n_worlds):
            now = set(bodies.id[bodies.world == world].tolist())
            born = now - last_seen[world]
            assert not born & ever[world], "an id was used again"
            ever[world] |= now
            last_seen[world] = now

    sim.observers.append(look)
    sim.step(10)
    assert [r.end for r in sim.result()] == ["time"] * n_worlds
