"""Searches that start from a guess find what a full search finds, and one serves rewards and observations of a step."""

from types import SimpleNamespace

import numpy as np
import pytest
from flee import Flee

from tussle.api.bodies import Bodies
from tussle.numeric.neighbors.search import ANY, DIFFERENT, SAME
from tussle.rl import Battle, Formation, NearestOthers, Term, make_swarm, searches
from tussle.rl.searches import SharedSearches


@pytest.mark.parametrize("n", [1, 5, 63, 64, 65, 200])
@pytest.mark.parametrize(("mode", "radius"), [(ANY, np.inf), (SAME, np.inf), (DIFFERENT, 30.0), (ANY, 8.0)])
def test_any_guess_gives_the_nearest(n, mode, radius):
    chance = np.random.default_rng(n)
    bodies = Bodies.empty(2 * n, 2)
    bodies.pos[:] = chance.normal(0.0, 20.0, (3, 2 * n))
    bodies.pos[:, n : n + n // 3] = 1.0  # many at one place
    bodies.world[n:] = 1
    bodies.id[:] = np.tile(np.arange(1, n + 1), 2)
    bodies.team[:] = chance.integers(1, 3, 2 * n)
    index = bodies.index(np.inf)
    rows, team, k = np.arange(2 * n), bodies.team.astype(float), 4
    places = index.row_world, index.place, index.order
    arrays = *index.table, bodies.by_place(index, "team")[0]
    square = ((bodies.pos[:, :, None] - bodies.pos[:, None, :]) ** 2).sum(axis=0)
    counts = (bodies.world[:, None] == bodies.world) & ~np.eye(2 * n, dtype=bool) & (square < radius**2)
    if mode != ANY:
        counts &= (bodies.team[:, None] == bodies.team) == (mode == SAME)
    by_hand = np.argsort(np.where(counts, square, np.inf), axis=1, kind="stable")[:, :k]
    n_found = np.minimum(counts.sum(axis=1), k)
    by_hand = np.pad(by_hand, ((0, 0), (0, k - by_hand.shape[1])))
    by_hand[np.arange(k) >= n_found[:, None]] = -1
    for guess in (0.0, 1e-9, 3.0, 25.0, 1e9, np.inf):
        shared = SharedSearches(2 * n)
        shared._guesses[None, radius] = np.full(2 * n, guess or 1e-300)

        def split(m, run):
            run(0, m)

        near = shared.nearest(bodies, None, (rows, rows, team), places, arrays, (k, mode, radius), split)
        np.testing.assert_array_equal(near, by_hand)
        again = shared._guesses[None, radius]
        np.testing.assert_array_equal(
            np.isinf(again), n_found < k
        )  # one search next time, where there are too few


@pytest.mark.parametrize("which", [Formation, Battle])
def test_a_search_with_guesses_is_one_without(which, monkeypatch):
    seen = []
    for is_kept in (True, False):
        swarm = make_swarm(which, 2, autoreset="same_step")
        if not is_kept:
            monkeypatch.setattr(
                NearestOthers, "_write_found", lambda self, *a: self._write_blocks(*a[:-1], np.inf, a[-1])
            )
        swarm.reset(seed=3)
        chance = np.random.default_rng(3)
        for _ in range(60):
            obs, *_ = swarm.step(chance.uniform(-1, 1, (2, swarm.n_agents, swarm.action_width)))
            seen.append(obs.tobytes())
    assert seen[:60] == seen[60:]


def test_rewards_and_observations_share_a_search(monkeypatch):
    """Of Formation, and of a reward of one's own that asks for fewer of the same others as the observation does."""
    calls = []
    search = searches.find_from_guess
    monkeypatch.setattr(searches, "find_from_guess", lambda *a: calls.append(a) or search(*a))

    def lonely(now):
        return now.nearest(k=2).distance[..., 1] > 50.0

    mine = Flee(reward={"lonely": Term(lonely)}, observation=(NearestOthers(5),))
    for task in (Formation(), mine):
        swarm = make_swarm(task, 2)
        swarm.reset(seed=1)
        idle = np.zeros((2, swarm.n_agents, swarm.action_width))
        swarm.step(idle)
        calls.clear()
        for _ in range(4):
            swarm.step(idle)
        assert len(calls) == 4 * len({part.group for part in swarm._watching})


def test_the_living_of_blocks_and_teams_are_counted():
    told = []
    task = Flee(reward={"note": Term(lambda now: told.append(now) or 0.0)})
    swarm = make_swarm(task, 2, autoreset="disabled")
    swarm.reset(seed=1)
    blocks = [SimpleNamespace(name=b.name, team=b.team) for b in task.given.blocks]
    for _ in range(40):
        swarm.step(np.zeros((2, swarm.n_agents, swarm.action_width)))
        now = told.pop()
        for block in blocks:
            there = swarm.simulation.read(f"{block.name}.team")[1].sum(axis=1)
            np.testing.assert_array_equal(now.n_living(block.name), there)
        total = now.n_living(" ".join(b.name for b in blocks))
        np.testing.assert_array_equal(total, now.n_living(blocks[0].team) + now.n_living(blocks[1].team))
    assert (~swarm.alive).any()
    for wrong in ("own", None, "preys", 7):
        with pytest.raises(Exception, match=r"prey|team|own"):
            now.n_living(wrong)
