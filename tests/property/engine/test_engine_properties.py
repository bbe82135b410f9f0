"""What holds for any rate, delay, and order of births and deaths."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from small_worlds import Drift, Listener, Talker, block, mission

from tussle import Simulation
from tussle.api import Interaction, Param
from tussle.mission.cadence import Cadence
from tussle.stock import GlobalNetwork

few = settings(max_examples=25)


class Rated:
    """What a cadence asks of a plugin."""

    instance_name = "Rated"

    def __init__(self, rate):
        self.rate = rate


@few
@given(
    rate=st.fractions("1/100", "9.99", max_denominator=100),
    per_second=st.sampled_from([10, 40, 60, 120, 1000]),
    n_substeps=st.integers(1, 5),
    days=st.integers(0, 100),
)
def test_calls_are_the_floor_of_the_time_times_the_rate_and_their_dt_is_the_time_between_them(
    rate, per_second, n_substeps, days
):
    """Whatever numbers of floating point stand for the rate and the grid, and after any number of days."""
    grid = n_substeps * per_second
    cadence = Cadence.of(Rated(float(rate)), 1.0 / (1.0 / grid), n_substeps, "here")
    begin = days * 86400 * per_second
    last = None
    for k in range(begin * n_substeps, begin * n_substeps + 3000):
        n_calls = 1 + k * rate // grid  # up to this point
        since = cadence.since(*divmod(k, n_substeps))
        assert bool(since) == (k == 0 or n_calls > 1 + (k - 1) * rate // grid)
        if since:
            assert since == k - last if last is not None else since > 0
            last = k


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
        bodies = s.state.population.bodies
        for group in s.state.population.groups:
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
