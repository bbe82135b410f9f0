"""Seeds and parameters belong to a world's episode: any sequence of resets gives each world what a fresh one gets alone."""

import numpy as np
import pytest
from flee import Flee, mission
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from hypothesis import given, settings
from hypothesis import strategies as st

from tussle import Simulation
from tussle.api import Autonomy, Handle
from tussle.errors import ParameterError, TussleError
from tussle.rl import choice, make, make_swarm, make_vec, parallel_env, uniform
from tussle.stock import SimpleCapture, SimpleCollision

N = 3
SPEED, TURN, REACH = "prey.Unicycle.vel_max", "prey.Unicycle.turn_rate_max", "SimpleCapture.capture_range"
BANKS, PURSUE, ROOM = (
    "prey.Unicycle.enable_roll",
    "hunters.Predator.pursue",
    "SimpleCollision.startup_collision_range",
)
RULES = [SimpleCapture(capture_range=12), SimpleCollision(collision_range=1.0)]


class Short(Flee):
    """Episodes of four decisions; each draws the prey's turn rate."""

    mission = mission(interactions=RULES)
    time_limit = 0.4
    vary = (f"{TURN}=1:2",)


class Model:
    """What each world of a swarm has been given, and the actions of its present episode."""

    def __init__(self, task, autoreset):
        self.task = task
        self.swarm = make_swarm(task, N, autoreset=autoreset)
        self.swarm.reset(seed=1)
        self.params = [{} for _ in range(N)]
        self.actions = [[] for _ in range(N)]
        self.chance = np.random.default_rng(1)

    def reset(self, seeds, worlds, params):
        before = self.swarm.seeds.copy()
        self.swarm.reset(seeds, worlds, params)
        for i, w in enumerate(worlds):
            self.actions[w] = []
            if params == {}:
                self.params[w] = {}
            for path, value in (params or {}).items():
                self.params[w][path] = value[i] if isinstance(value, list) else value
            given_seed = seeds[i] if isinstance(seeds, list) else None if seeds is None else seeds + w
            assert (
                self.swarm.seeds[w] == given_seed
                if given_seed is not None
                else self.swarm.seeds[w] != before[w]
            )
        others = np.setdiff1d(np.arange(N), worlds)
        np.testing.assert_array_equal(self.swarm.seeds[others], before[others])

    def step(self):
        actions = self.chance.uniform(-1, 1, (N, 6, 2)).astype(np.float32)
        restarts = self.swarm.over & (self.swarm.autoreset == "next_step")
        self.swarm.step(actions)
        restarts |= self.swarm.over & (self.swarm.autoreset == "same_step")
        for w in range(N):
            self.actions[w] = [] if restarts[w] else [*self.actions[w], actions[w : w + 1]]

    def check(self):
        """Compare each world with a simulation that begins, and a swarm that plays, its episode alone."""
        for w in range(N):
            alone = make_swarm(self.task, 1, autoreset="disabled")
            alone.reset(seed=int(self.swarm.seeds[w]), params=self.params[w])
            begun = Simulation(self.task.played, int(self.swarm.seeds[w]), alone.episodes.values[0])
            assert alone.simulation.state_hash() == begun.state_hash()
            for actions in self.actions[w]:
                alone.step(actions)
            assert self.swarm.simulation.state_hash(w) == alone.simulation.state_hash(), (w, self.params[w])
            np.testing.assert_array_equal(self.swarm.obs[w], alone.obs[0])
            for path in (SPEED, TURN):
                mine, single = (s.simulation.read(path)[0] for s in (self.swarm, alone))
                np.testing.assert_array_equal(mine[w], single[0])


def one_or_each(values):
    """One value for all of three worlds, or a list of three, of which the tests take as many as there are worlds."""
    return values | st.lists(values, min_size=N, max_size=N)


PARAMS = (
    st.none()
    | st.just({})
    | st.fixed_dictionaries(
        {},
        optional={
            SPEED: one_or_each(st.sampled_from([0.5, 10.0, "40 kt"])),
            TURN: one_or_each(st.sampled_from([0.25, 1.5])),
            REACH: one_or_each(st.sampled_from([0.0, 30.0])),
            BANKS: one_or_each(st.booleans()),
        },
    )
)
SEED = st.integers(0, 2**64 - 1)
RESET = st.tuples(
    st.just("reset"),
    st.lists(st.integers(0, N - 1), unique=True, min_size=1),
    st.none() | st.integers(0, 2**64 - N) | st.lists(st.none() | SEED, min_size=N, max_size=N),
    PARAMS,
)
STEP = st.tuples(st.just("step"), st.integers(1, 6))
REFUSED = st.tuples(
    st.just("refused"),
    st.lists(st.integers(0, N - 1), unique=True, min_size=1),
    st.sampled_from(
        [
            (7, {"prey.Unicycle.vel_maxx": 1.0}),
            (7, {SPEED: -1.0}),
            (7, {SPEED: 5.0, TURN: [1.0] * 4}),
            (7, {SPEED: [[1.0], [2.0, 3.0]]}),
            (7, {SPEED: np.nan}),
            (7, {SPEED: "fast"}),
            (7, {3: 1.0}),
            (7, [SPEED]),
            (7, {BANKS: "perhaps"}),
            (7, {PURSUE: False, SPEED: 3.0}),
            (7, {ROOM: 1e5, SPEED: 3.0}),
            (-1, {SPEED: 3.0}),
            (2**64, {}),
            ([7] * 4, {SPEED: 3.0}),
            (["x", 7, 7], {}),
            (True, {}),
            (1.5, {}),
            ("7", None),
        ]
    ),
)


def cut(value, n):
    """A list of as many items as there are worlds."""
    return value[:n] if isinstance(value, list) and len(value) == N else value


@settings(max_examples=25)
@given(
    autoreset=st.sampled_from(["same_step", "next_step", "disabled"]),
    operations=st.lists(RESET | STEP | REFUSED, min_size=3, max_size=7),
)
@pytest.mark.slow
def test_each_world_is_as_alone_after_any_resets(autoreset, operations):
    model = Model(Short(), autoreset)
    for operation, *given_ in operations:
        if operation == "step":
            for _ in range(given_[0]):
                model.step()
        elif operation == "reset":
            worlds, seeds, params = given_
            params = params and {path: cut(value, len(worlds)) for path, value in params.items()}
            model.reset(cut(seeds, len(worlds)), worlds, params)
        else:
            worlds, (seeds, params) = given_
            before = model.swarm.state()
            with pytest.raises(TussleError):
                model.swarm.reset(cut(seeds, len(worlds)), worlds, params)
            after = model.swarm.state()
            for name in model.swarm.KEPT:
                np.testing.assert_array_equal(after[name], before[name])
    model.check()


# -- parameters in each view --------------------------------------------------------------------------------------------------


class Bounds(Flee):
    """Worlds end at different times, when a prey leaves a square."""

    mission = mission(interactions=RULES)

    def ends(self, now):
        return (np.abs(now.pos[..., :2]) > 61.0).any(axis=(1, 2))


def speeds(swarm):
    """Limit of speed of the prey in each world, and that they obey."""
    values, there = swarm.simulation.read(SPEED)
    return np.where(there, values, 0.0).max(axis=1)


@pytest.mark.parametrize("mode", ["same_step", "next_step", AutoresetMode.SAME_STEP])
def test_worlds_that_begin_by_themselves_keep_their_own_parameters(mode):
    given_ = [10.0, 20.0, 30.0, 40.0]
    envs = make_vec(Bounds, 4, autoreset=mode)
    envs.reset(seed=1, options={"params": {SPEED: given_}})
    n_ends = np.zeros(4, int)
    for _ in range(120):
        envs.step(np.ones((4, 6, 2), np.float32))
        n_ends += envs.swarm.over
        np.testing.assert_array_equal(
            speeds(envs.swarm)[envs.swarm.alive.any(axis=1)], np.array(given_)[envs.swarm.alive.any(axis=1)]
        )
    assert (n_ends > 2).all()
    assert len(set(n_ends)) > 1


def test_values_for_some_worlds_change_only_these(task):
    envs = make_vec(task, 4)
    envs.reset(seed=1)
    envs.reset(options={"reset_mask": np.array([0, 0, 1, 0], bool), "params": {SPEED: 1.0}})
    assert speeds(envs.swarm).tolist() == [20.0, 20.0, 1.0, 20.0]
    envs.reset(seed=5)
    assert speeds(envs.swarm).tolist() == [20.0, 20.0, 1.0, 20.0]
    envs.reset(options={"reset_mask": [True, False, True, False], "params": {SPEED: [2.0, 3.0]}})
    assert speeds(envs.swarm).tolist() == [2.0, 20.0, 3.0, 20.0]
    envs.reset(options={"reset_mask": np.array([1, 0, 0, 0], bool), "params": {}})
    assert speeds(envs.swarm).tolist() == [20.0, 20.0, 3.0, 20.0]
    envs.reset(seed=[None] * 4, options={"params": {SPEED: 7.0}})
    assert speeds(envs.swarm).tolist() == [7.0] * 4
    envs.reset(options={"params": None})
    assert speeds(envs.swarm).tolist() == [7.0] * 4
    envs.reset(seed=[None, 5, None, 6], options={"params": {SPEED: [1.0, 2.0, 3.0, 4.0]}})
    assert speeds(envs.swarm).tolist() == [1.0, 2.0, 3.0, 4.0]
    assert envs.swarm.seeds[[1, 3]].tolist() == [5, 6]
    envs.reset(options={"params": {}})
    assert speeds(envs.swarm).tolist() == [20.0] * 4


def test_given_parameters_are_not_drawn_until_they_are_cleared(task):
    swarm = make_swarm(task.replace(vary=[f"{SPEED}=10:20"]), 2)
    swarm.reset(seed=1)
    drawn = speeds(swarm)
    swarm.reset([1], [0], {SPEED: 5.0})
    swarm.reset(seed=1)
    assert speeds(swarm).tolist() == [5.0, drawn[1]]
    swarm.reset(seed=1, params={})
    np.testing.assert_array_equal(speeds(swarm), drawn)


def test_restore_returns_to_the_parameters(task):
    swarm = make_swarm(task, 2)
    swarm.reset(seed=1, params={SPEED: [5.0, 6.0]})
    saved = swarm.state()
    swarm.reset(params={SPEED: 1.0})
    swarm.restore(saved)
    swarm.reset()
    assert speeds(swarm).tolist() == [5.0, 6.0]


def one_world(view, task):
    """A view of one world: a function of seed and parameters that resets it, one that steps it, and its swarm."""
    env = {"Env": make, "ParallelEnv": parallel_env, "VectorEnv": make_vec}[view](task)
    ones = np.ones((6, 2), np.float32)

    def step():
        if view == "ParallelEnv":
            return env.step(dict.fromkeys(env.agents, ones[0]))
        return env.step(ones[None] if view == "VectorEnv" else ones)

    return lambda seed, params: env.reset(seed=seed, options={"params": params}), step, env


def leaves(value):
    """Arrays and numbers in a result, in order."""
    if isinstance(value, dict):
        return [leaf for name in sorted(value) for leaf in leaves(value[name])]
    return (
        [leaf for each in value for leaf in leaves(each)] if isinstance(value, tuple) else [np.asarray(value)]
    )


WRONG = [
    (1, {"prey.Unicycle.vel_maxx": 1.0}, "did you mean 'vel_max'"),
    (1, {SPEED: -1.0}, "vel_max = -1.0 is not allowed"),
    (1, {SPEED: [1.0, 2.0]}, "has 2 values for 1 worlds"),
    (1, {SPEED: 3.0, "prey.count": 4}, "is the same in all worlds"),
    (1, {SPEED: 3.0, ROOM: 1e5}, "no free position"),
    (1, {"hunters.Unicycle.use_pitch": False}, "velocity_z"),
    (1, {None: 3.0}, "a path is a text"),
    (1, 5.0, "params = 5.0 is not allowed; it takes values by path"),
    (-1, {SPEED: 3.0}, "seed = -1 is not allowed; it takes a whole number from 0 to 2"),
    (2**64, {SPEED: 3.0}, "seed = 18446744073709551616 is not allowed"),
    (2**70, None, "is not allowed"),
    (1.5, None, r"seed = 1.5 is not allowed"),
    (True, None, "seed = True is not allowed"),
    ("1", {}, "seed = '1' is not allowed"),
    ([7, 8], {SPEED: 3.0}, r"seed = \[7, 8\] is not allowed"),
]


@pytest.mark.parametrize("view", ["Env", "ParallelEnv", "VectorEnv"])
@pytest.mark.parametrize(("seed", "params", "message"), WRONG)
def test_a_refused_reset_changes_nothing(view, seed, params, message):
    task = Flee(mission=mission(interactions=RULES))
    reset, step, env = one_world(view, task)
    _, control, other = one_world(view, task)
    for each in (env, other):
        each.reset(seed=3, options={"params": {REACH: 5.0}})
    for each in (step, control) * 2:
        each()
    with pytest.raises(TussleError, match=message):
        reset(seed, params)
    for _ in range(3):
        for mine, single in zip(leaves(step()), leaves(control()), strict=True):
            np.testing.assert_array_equal(mine, single)
    if view != "ParallelEnv":
        assert env.np_random_seed == other.np_random_seed
    for mine, single in zip(leaves(reset(None, None)), leaves(other.reset()), strict=True):
        np.testing.assert_array_equal(mine, single)
    assert env.swarm.simulation.state_hash() == other.swarm.simulation.state_hash()


@pytest.mark.parametrize("view", ["Env", "ParallelEnv", "VectorEnv"])
def test_all_views_keep_and_clear_parameters(view, task):
    reset, step, env = one_world(view, task)
    for seed, params, want in (
        (1, {SPEED: "10 m/s"}, 10.0),
        (None, None, 10.0),
        (2, {REACH: 3.0}, 10.0),
        (3, {}, 20.0),
    ):
        reset(seed, params)
        step()
        assert speeds(env.swarm).tolist() == [want]


# -- seeds and worlds ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("is_running", [False, True])
@pytest.mark.parametrize(
    "seed",
    [
        *(
            [7],
            [7, 8],
            [7] * 5,
            [],
            [7, 8, 9, -1],
            [7, 8, 9, 2**64],
            [7, 8, 9, 1.0],
            [7, 8, 9, True],
            [[1], [2], [3], [4]],
        ),
        *(2**64 - 3, -1, np.float64(1), np.array([7]), np.array(7.5), {7: 1}, "1234"),
    ],
)
def test_wrong_seeds_are_refused(task, seed, is_running):
    envs = make_vec(task, 4)
    if is_running:
        envs.reset(seed=1)
        envs.step(np.ones((4, 6, 2), np.float32))
    before = envs.swarm.seeds.copy(), envs.swarm.lengths.copy(), envs.swarm.is_fresh
    with pytest.raises(
        ParameterError, match=r"seed = .* is not allowed; it (takes a whole number from 0 to 2|has)"
    ):
        envs.reset(seed=seed)
    np.testing.assert_array_equal(before[0], envs.swarm.seeds)
    np.testing.assert_array_equal(before[1], envs.swarm.lengths)
    assert envs.swarm.is_fresh is before[2]
    envs.reset(seed=1)
    envs.step(np.ones((4, 6, 2), np.float32))


@pytest.mark.parametrize(
    "seed", [[0, 1, 2**64 - 1, 2**63], np.array([7, 8, 9, 10], np.uint64), range(4), 2**64 - 4]
)
def test_seeds_are_those_that_are_given(task, seed):
    envs = make_vec(task, 4)
    _, info = envs.reset(seed=seed)
    want = [seed + w for w in range(4)] if isinstance(seed, int) else [int(s) for s in seed]
    assert info["seed"].tolist() == want
    for w in (0, 3):
        assert envs.swarm.simulation.state_hash(w) == Simulation(task.played, want[w]).state_hash()


def test_seeds_that_are_missing_follow(task):
    first, second = make_vec(task, 3), make_vec(task, 3)
    for envs in (first, second):
        envs.reset(seed=1)
    first.reset(seed=[None, 9, None])
    second.reset()
    assert first.swarm.seeds.tolist() == [second.swarm.seeds[0], 9, second.swarm.seeds[2]]


def test_where_some_worlds_are_reset_first_all_have_begun(task):
    envs = make_vec(task, 3)
    obs, info = envs.reset(seed=[5, 6, 7], options={"reset_mask": np.array([0, 1, 0], bool)})
    assert (np.abs(obs).max(axis=(1, 2)) > 0).all()
    for w in range(3):
        alone, _ = make(task).reset(seed=int(info["seed"][w]))
        np.testing.assert_array_equal(obs[w], alone)


@pytest.mark.parametrize("mask", [[True], np.ones(3, bool), [0, 1, 2, 0], np.ones((4, 1), bool), "abcd", 1])
def test_wrong_masks_are_refused(task, mask):
    envs = make_vec(task, 4)
    with pytest.raises(ParameterError, match=r"reset_mask = .* is not allowed; it takes 4 truth values"):
        envs.reset(seed=1, options={"reset_mask": mask})


@pytest.mark.parametrize("worlds", [[4], [-1], [0, 0], [1.0], np.ones(3, bool), [[0]], "all"])
def test_wrong_worlds_are_refused(task, worlds):
    swarm = make_swarm(task, 4)
    with pytest.raises(ParameterError, match=r"worlds = .* numbers from 0 to 3, each once, or a mask of 4"):
        swarm.reset(seed=1, worlds=worlds)


def test_no_worlds_are_no_reset(task):
    swarm = make_swarm(task, 2)
    swarm.reset(seed=1, params={SPEED: 5.0})
    before = swarm.simulation.state_hash(0)
    swarm.reset(seed=[], worlds=[], params={SPEED: 1.0})
    swarm.reset(worlds=[], params={})
    assert swarm.simulation.state_hash(0) == before
    assert speeds(swarm).tolist() == [5.0, 5.0]


@pytest.mark.parametrize("view", [make, parallel_env])
def test_one_world_has_no_mask(task, view):
    with pytest.warns(UserWarning, match="ignores the option 'reset_mask'"):
        view(task).reset(seed=1, options={"reset_mask": [True]})


def test_worlds_that_cannot_be_copied_need_another_reset(task):
    """A plugin's objects may have no copy to return to: parameters and seeds return, and the world has to begin again."""

    class Held(Autonomy):
        link = Handle()

        def open_one(self, row):
            return object()

        def step(self, g):
            pass

    prey, hunters = task.mission.blocks
    hunters = hunters.replace(autonomy=(*hunters.autonomy, Held()))
    game = task.mission.replace(blocks=[prey, hunters], interactions=RULES)
    swarm = make_swarm(task.replace(mission=game))
    swarm.reset(seed=1, params={SPEED: 5.0})
    with pytest.raises(TussleError, match="no free position"):
        swarm.reset(seed=2, params={SPEED: 6.0, ROOM: 1e5})
    with pytest.raises(ParameterError, match="step was called before reset"):
        swarm.step(np.ones((1, 6, 2), np.float32))
    swarm.reset()
    swarm.step(np.ones((1, 6, 2), np.float32))
    assert swarm.seeds.tolist() == [1]
    assert speeds(swarm).tolist() == [5.0]


# -- distributions ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("where", ["params", "task", "text"])
def test_each_episode_draws_from_its_distribution(task, where):
    vary = {"task": {SPEED: uniform(10.0, 20.0)}, "text": {SPEED: "10:20"}}.get(where, ())
    params = {SPEED: uniform(10.0, 20.0)} if where == "params" else None
    swarm = make_swarm(task.replace(vary=vary, time_limit=0.2), 30)
    swarm.reset(seed=1, params=params)
    first = speeds(swarm)
    assert 10.0 <= first.min() < 12.0 < 18.0 < first.max() <= 20.0
    seen = [first]
    for _ in range(6):
        swarm.step(np.zeros((30, 6, 2), np.float32))
        np.testing.assert_array_equal(swarm.params[SPEED], speeds(swarm))
        if swarm.over.all():
            np.testing.assert_array_equal(swarm.final_params[SPEED], seen[-1])
            assert (speeds(swarm) != seen[-1]).all()
            seen.append(speeds(swarm))
    assert len(seen) == 4
    again = make_swarm(task.replace(vary=vary), 1)
    again.reset(seed=int(swarm.seeds[7]), params=params)
    assert speeds(again).tolist() == [seen[-1][7]]
    swarm.reset(seed=1)
    np.testing.assert_array_equal(speeds(swarm), first)
    swarm.reset(seed=1, params={})
    np.testing.assert_array_equal(speeds(swarm), 20.0 if where == "params" else first)
    assert (SPEED in swarm.params) is (where != "params")


def test_worlds_may_have_distributions_and_values(task):
    swarm = make_swarm(task, 4)
    swarm.reset(
        seed=1, params={SPEED: [uniform(1.0, 2.0), 5.0, choice([7.0, 8.0]), uniform(10, 19, unit="kt")]}
    )
    one, two, three, four = speeds(swarm)
    assert 1.0 < one < 2.0
    assert two == 5.0
    assert three in (7.0, 8.0)
    assert 10 * 1852 / 3600 < four < 19 * 1852 / 3600
    swarm.reset(seed=5, worlds=[0], params={SPEED: 3.0})
    assert speeds(swarm).tolist() == [3.0, two, three, four]
    swarm.reset(seed=6)
    assert speeds(swarm)[:2].tolist() == [3.0, 5.0]
    assert speeds(swarm)[3] != four
    swarm.reset(worlds=[3], params={})
    assert speeds(swarm)[3] == 20.0
    assert swarm.params[f"_{SPEED}"].tolist() == [True, True, True, False]


@pytest.mark.parametrize(
    ("value", "message"),
    [
        (uniform(-1.0, 5.0), "vel_max = -1.0 is not allowed"),
        (choice([1.0, "fast"]), "fast"),
        ([uniform(1, 2), 3.0], "has 2 values for 1 worlds"),
        ([-3.0, uniform(1, 2)][:1], "-3.0 is not allowed"),
    ],
)
def test_a_distribution_is_checked_before_it_is_drawn(task, value, message):
    swarm = make_swarm(task)
    swarm.reset(seed=1, params={SPEED: 4.0})
    before = swarm.simulation.state_hash()
    with pytest.raises(ParameterError, match=message):
        swarm.reset(seed=2, params={SPEED: value})
    assert swarm.simulation.state_hash() == before
    assert swarm.params == {SPEED: 4.0, f"_{SPEED}": True}
    if not isinstance(value, list):
        with pytest.raises(ParameterError, match=message):
            make_swarm(task.replace(vary={SPEED: value}))
    with pytest.raises(ParameterError, match=r"it takes uniform\(10, 20\)"):
        make_swarm(task.replace(vary={SPEED: 3.0}))


@pytest.mark.parametrize("view", ["Env", "ParallelEnv", "VectorEnv"])
def test_infos_tell_seed_and_parameters(view, task):
    reset, step, env = one_world(view, task)

    def told(result):
        info = result[-1]["prey_0"] if view == "ParallelEnv" else result[-1]
        assert np.all(info["seed"] == env.swarm.seeds[0])
        return {k: np.ravel(v).tolist() for k, v in info.get("params", {}).items() if not k.startswith("_")}

    assert told(reset(1, None)) == {}
    drawn = told(reset(2, {SPEED: uniform(10.0, 20.0), TURN: "90 deg/s"}))
    assert drawn == {SPEED: speeds(env.swarm).tolist(), TURN: [np.pi / 2]}
    if view != "ParallelEnv":
        assert told(step()) == drawn
    assert told(reset(3, {})) == {}


def test_the_info_of_an_ended_episode_tells_its_seed_and_parameters():
    """As Gymnasium's own vector environments do, from single ones."""
    params = {"params": {SPEED: uniform(10.0, 20.0)}}
    task = Bounds(reward={"caught": Bounds.reward["captured"]})
    mine = make_vec(task, 3, autoreset=AutoresetMode.SAME_STEP)
    theirs = SyncVectorEnv([lambda: make(task)] * 3, autoreset_mode=AutoresetMode.SAME_STEP)
    mine.reset(seed=1, options=params)
    for env, seed in zip(theirs.envs, mine.swarm.seeds, strict=True):
        env.reset(seed=int(seed), options=params)
    theirs._autoreset_envs[:] = False
    n_ends = 0
    for _ in range(80):
        ones = np.ones((3, 6, 2), np.float32)
        info, want = mine.step(ones)[-1], theirs.step(ones)[-1]
        assert ("final_info" in info) is ("final_info" in want)
        if "final_info" in info:
            n_ends += info["_final_info"].sum()
            np.testing.assert_array_equal(info["_final_info"], want["_final_info"])
            assert info["final_info"].keys() == want["final_info"].keys()
            for a, b in zip(leaves(info["final_info"]), leaves(want["final_info"]), strict=True):
                np.testing.assert_allclose(a, b, rtol=1e-6)
    assert n_ends > 5
