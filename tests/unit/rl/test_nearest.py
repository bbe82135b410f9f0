"""`now.nearest` and `now.n_within` are what a search of all pairs finds."""

import numpy as np
import pytest
from flee import Flee, mission

from tussle.errors import ParameterError
from tussle.rl import Act, NearestOthers, Term, make_swarm
from tussle.stock import SimpleCapture

OF = (None, "own", "other", 2, "hunters", "late", "prey hunters", "hunters late prey")


class Pack(Flee):
    """Prey, hunters and others that are born late; the first two learn."""

    prey, hunters = Flee.mission.blocks
    mission = mission(
        blocks=[prey, hunters, prey.replace(name="late", team=3, count=3, rate=1.5, first_birth=0.5)],
        interactions=[SimpleCapture(capture_range=12)],
    )
    learners = "prey hunters"
    action = {"prey": Flee.action, "hunters": (Act("Predator.max_speed", 20.0, 40.0),)}  # noqa: RUF012


def everyone(swarm):
    """Position, velocity, team, id and block of all entities by world, and the place of each agent among them or -1."""
    found = []
    for name in ("prey", "hunters", "late"):
        (pos, there), vel = swarm.simulation.read(f"{name}.pos"), swarm.simulation.read(f"{name}.vel")[0]
        ids, team = (swarm.simulation.read(f"{name}.{k}")[0] for k in ("id", "team"))
        found.append((pos, vel, team, ids, np.full(ids.shape, name), there))
    return [np.concatenate(parts, axis=1) for parts in zip(*found, strict=True)]


def wanted(of, mine, team, block):
    names = of.split() if isinstance(of, str) else []
    return {None: np.ones(len(team), bool), "own": team == mine, "other": team != mine}.get(
        of, np.isin(block, names) if names else team == of
    )


@pytest.mark.parametrize("of", OF)
@pytest.mark.parametrize("threads", [1, 2])
def test_they_find_what_a_search_of_all_pairs_finds(of, threads):
    told = []

    def note(now):
        told.append((now.nearest(of), now.nearest(of, 40.0, k=3), now.n_within(30.0, of)))
        return 0.0

    swarm = make_swarm(Pack(reward={"note": Term(note)}), 3, autoreset="disabled", threads=threads)
    swarm.reset(seed=1)
    chance, n_dead, n_missing = np.random.default_rng(1), 0, 0
    for _ in range(45):
        swarm.step(chance.uniform(-1, 1, (3, 8, 2)).astype(np.float32))
        one, three, count = told.pop()
        pos, vel, team, _, block, there = everyone(swarm)
        n_dead += (~swarm.alive).sum()
        for w, a in np.ndindex(3, 8):
            others = there[w] & wanted(of, team[w, a], team[w], block[w]) & (np.arange(pos.shape[1]) != a)
            others &= there[w, a]
            offset, relative = pos[w] - pos[w, a], vel[w] - vel[w, a]
            distance = np.where(others, np.sqrt((offset**2).sum(axis=-1)), np.inf)
            order = np.argsort(distance, kind="stable")
            near = [k for k in order[:3] if distance[k] < 40.0]
            assert count[w, a] == (distance < 30.0).sum()
            assert three.found[w, a].tolist() == [True] * len(near) + [False] * (3 - len(near))
            assert three.distance[w, a].tolist() == [*distance[near], *[np.inf] * (3 - len(near))]
            np.testing.assert_array_equal(three.offset[w, a, : len(near)], offset[near])
            assert not three.offset[w, a, len(near) :].any()
            first = order[0]
            assert one.found[w, a] == np.isfinite(distance[first])
            assert one.distance[w, a] == distance[first]
            if one.found[w, a]:
                np.testing.assert_array_equal(one.offset[w, a], offset[first])
                np.testing.assert_array_equal(one.relative_vel[w, a], relative[first])
            else:
                n_missing += 1
    assert n_dead > 10
    assert n_missing >= n_dead


def test_worlds_of_other_sizes_and_ends_see_the_same():
    """In `ends` and in any stack: the values of a world alone."""

    class Ending(Pack):
        def ends(self, now):
            held.append((now.nearest("hunters").distance.copy(), now.n_within(50.0, "other").copy()))
            return False

    held = []
    results = []
    for worlds in (1, 5):
        swarm = make_swarm(Ending, worlds, autoreset="next_step")
        swarm.reset(seed=4)
        for k in range(70):
            swarm.step(np.full((worlds, 8, 2), np.sin(k), np.float32))
        results.append([(d[0], n[0]) for d, n in held])
        held.clear()
    for (d, n), (e, m) in zip(*results, strict=True):
        np.testing.assert_array_equal(d, e)
        np.testing.assert_array_equal(n, m)


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (lambda now: now.nearest("huntres"), r"there is no block 'huntres' \(did you mean 'hunters'\?\)"),
        (lambda now: now.nearest("prey hunter"), "there is no block 'hunter'"),
        (lambda now: now.nearest(""), "there is no block ''"),
        (lambda now: now.nearest(7), "of = 7: there is no such team; there are: 1, 2"),
        (lambda now: now.nearest(True), "of = True is not allowed"),
        (lambda now: now.nearest(1.0), "of = 1.0 is not allowed"),
        (lambda now: now.nearest(None, 0.0), "radius = 0.0 is not allowed"),
        (lambda now: now.nearest(k=0), "k = 0 is not allowed"),
        (lambda now: now.n_within(np.inf), "radius = inf is not allowed"),
        (lambda now: now.n_within(-1.0), "radius = -1.0 is not allowed"),
        (lambda now: now.n_within(5.0, "others"), r"no block 'others' \(did you mean 'other'\?\)"),
    ],
)
def test_wrong_questions_are_refused(ask, message):
    swarm = make_swarm(Flee(reward={"ask": Term(ask)}))
    swarm.reset(seed=1)
    with pytest.raises(ParameterError, match=message):
        swarm.step(np.zeros((1, 6, 2), np.float32))


def test_observations_name_blocks_and_refuse_unknown_teams():
    task = Pack(learners="prey", observation=(NearestOthers(2, "offset", of="late hunters", frame="world"),))
    swarm = make_swarm(task, 2, autoreset="disabled")
    swarm.reset(seed=2)
    for _ in range(30):
        swarm.step(np.zeros((2, 6, 2), np.float32))
    near = swarm.now.nearest("late hunters", k=2).offset
    np.testing.assert_array_equal(swarm.obs, near.reshape(2, 6, 6).astype(np.float32))
    with pytest.raises(ParameterError, match="of = 9: there is no such team; there are: 1, 2, 3"):
        make_swarm(task.replace(observation=(NearestOthers(2, of=9),)))
