"""Births, masks, named parts of observations, states for centralised critics, and policies by block."""

import warnings

import numpy as np
import pytest
from flee import Flee
from gymnasium.utils.env_checker import check_env

from tussle.errors import ParameterError
from tussle.rl import (
    Act,
    Computed,
    Dispersal,
    Each,
    NearestOthers,
    NearOrigin,
    Own,
    PredatorsAndPrey,
    Term,
    evaluate,
    make,
    make_swarm,
    make_vec,
    parallel_env,
)


def by_mask(swarm, chance):
    """Actions that the masks allow, (W, A, 1)."""
    return np.array([[chance.choice(np.flatnonzero(agent)) for agent in world] for world in swarm.masks])[
        ..., None
    ]


# -- masks and births, in Dispersal --------------------------------------------------------------------------------------------


def test_robots_that_keep_to_the_mask_stay_in_the_room_and_enter_one_by_one():
    swarm, chance = make_swarm(Dispersal, 3), np.random.default_rng(1)
    swarm.reset(seed=1)
    n_before = swarm.alive.sum(axis=1)
    n_masked = 0
    for _ in range(59):
        swarm.step(by_mask(swarm, chance))
        n = swarm.alive.sum(axis=1)
        assert ((n - n_before) >= 0).all()
        assert ((n - n_before) <= 1).all()
        n_before, n_masked = n, n_masked + (~swarm.masks).sum()
        np.testing.assert_array_equal(swarm.central_state.sum(axis=1), n)  # none has left the room
    assert (n == 20).all()
    assert n_masked > 1000


def test_the_length_of_an_agent_counts_its_own_decisions():
    env = parallel_env(Dispersal(time_limit=8.0))
    env.reset(seed=1)
    taken, told = dict.fromkeys(env.possible_agents, 0), {}
    while not env.swarm.over[0]:
        for name in env.agents:
            taken[name] += 1
        mask = dict(zip(env.possible_agents, env.swarm.masks[0], strict=True))
        infos = env.step({name: np.int64(mask[name].argmax()) for name in env.agents})[-1]
        told |= {name: info["episode"]["l"] for name, info in infos.items() if "episode" in info}
    assert told == {name: n for name, n in taken.items() if n}
    assert len(set(told.values())) > 3


def test_masks_states_and_births_are_those_of_a_world_alone_of_threads_and_of_a_restored_one():
    def played(n, threads):
        swarm, seen = make_swarm(Dispersal(time_limit=12.0), n, threads=threads), []
        swarm.reset(seed=7)
        for t in range(40):
            moves = np.argmax(np.roll(swarm.masks, -t % 5, axis=-1), axis=-1) + t % 5
            obs, rewards, *_ = swarm.step((moves % 5)[..., None])
            seen.append(
                [x[0].tobytes() for x in (obs, rewards, swarm.masks, swarm.central_state, swarm.alive)]
            )
        return seen

    alone = played(1, 1)
    assert alone == played(4, 1) == played(4, 2)


def test_masks_and_states_follow_what_is_restored():
    swarm, chance = make_swarm(Dispersal, 2), np.random.default_rng(1)
    swarm.reset(seed=7)
    for _ in range(15):
        swarm.step(by_mask(swarm, chance))
    saved, actions = swarm.state(), by_mask(swarm, chance)
    masks, state = swarm.masks.copy(), swarm.central_state.copy()
    first = [x.copy() for x in swarm.step(actions)[:2]] + [swarm.masks.copy()]
    swarm.restore(saved)
    np.testing.assert_array_equal(swarm.masks, masks)
    np.testing.assert_array_equal(swarm.central_state, state)
    again = [*swarm.step(actions)[:2], swarm.masks]
    for a, b in zip(first, again, strict=True):
        np.testing.assert_array_equal(a, b)


@pytest.mark.filterwarnings("ignore:.*observation space m:UserWarning")
def test_gymnasium_and_pettingzoo_take_masks_and_parts():
    env = make(Dispersal(time_limit=10.0))
    check_env(env, skip_render_check=True)
    obs, info = env.reset(seed=1)
    assert list(obs) == ["near", "own"] == list(env.observation_space.spaces) or sorted(obs) == [
        "near",
        "own",
    ]
    assert env.observation_space.contains(obs)
    for _ in range(8):
        action = env.action_space.sample(mask=tuple(info["action_mask"]))  # Gymnasium's convention
        assert info["action_mask"].dtype == np.int8
        assert np.take_along_axis(info["action_mask"], action[:, None], axis=1).all()
        obs, *_, info = env.step(action)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of PettingZoo itself
        from pettingzoo.test import parallel_api_test

        parallel_api_test(parallel_env(Dispersal(time_limit=20.0)), num_cycles=60)
    agents = parallel_env(Dispersal())
    agents.reset(seed=1)
    _, _, _, _, infos = agents.step({})
    while len(agents.agents) < 5:
        actions = {a: agents.action_space(a).sample(infos[a]["action_mask"]) for a in agents.agents}
        obs, _, _, _, infos = agents.step(actions)
        for name in agents.agents:
            assert agents.observation_space(name).contains(obs[name])
            assert infos[name]["action_mask"].shape == (5,)
            assert infos[name]["action_mask"][0] == 1
    assert agents.state_space.contains(agents.state())
    assert agents.state().sum() == len(agents.agents)
    envs = make_vec(Dispersal(time_limit=3.0), 2, autoreset="same_step")
    obs, info = envs.reset(seed=1)
    for _ in range(7):
        assert envs.observation_space.contains(obs)
        assert info["action_mask"].shape == (2, 20, 5)
        obs, *_, info = envs.step(np.zeros((2, 20), int))
    assert info["_action_mask"].all()


class Choosy(NearOrigin):
    """A robot that may not go east in the east, in a task of one's own: one agent, two levels."""

    observation = {"place": (Own("pos", scale=10.0),), "speed": Own("vel")}  # noqa: RUF012

    def action_mask(self, now):
        east = now.pos[..., 0] > 0.0
        return np.stack([np.ones_like(east), ~east], axis=-1)


class TwoChoices(NearOrigin):
    """A robot that chooses among three speeds to the east, of which one is excluded, and two to the north."""

    action = (
        Act("velocity_x", levels=[-1.0, 0.0, 1.0]), Act("velocity_y", levels=[-1.0, 1.0]), Act("velocity_z", value=0.0),
    )  # fmt: skip

    def action_mask(self, now):
        return np.broadcast_to([True, False, True, True, False], (*now.alive.shape, 5))


def test_a_mask_of_several_actions_is_split_for_their_space():
    env = parallel_env(TwoChoices())
    _, infos = env.reset(seed=1)
    (name,) = env.agents
    space, mask = env.action_space(name), infos[name]["action_mask"]
    chosen = [space.sample(tuple(np.split(mask, np.cumsum(space.nvec)[:-1]))).tolist() for _ in range(30)]
    assert {tuple(each) for each in chosen} == {(0, 0), (2, 0)}


@pytest.mark.filterwarnings("ignore:.*observation space m:UserWarning")
def test_a_mask_of_ones_own_reaches_one_agent():
    env = make(Choosy())
    check_env(env, skip_render_check=True)
    obs, info = env.reset(seed=3)
    seen = set()
    for t in range(200):
        if t % 50 == 0:
            obs, info = env.reset(seed=t)
        assert obs.keys() == {"place", "speed"}
        assert info["action_mask"].tolist() == [1, int(obs["place"][0] <= 0.0)]
        seen.add(info["action_mask"].tolist()[1])
        obs, *_, info = env.step(env.action_space.sample(info["action_mask"]))
    assert seen == {0, 1}


@pytest.mark.parametrize(
    ("mask", "message"),
    [
        (
            lambda self, now: np.ones((1, 7), bool),
            r"action_mask returns .* of shape \(1, 7\); it returns truth values, \(1, 1, 2\)",
        ),
        (lambda self, now: np.ones((1, 7), bool), r"action_mask returns bool of shape \(1, 7\)"),
        (lambda self, now: np.ones((1, 1, 2)), "action_mask returns float64"),
        (lambda self, now: np.zeros((1, 1, 2), bool), "leaves robot_0 in world 0 no level"),
    ],
)
def test_masks_that_cannot_be_are_refused(mask, message):
    swarm = make_swarm(type("Wrong", (NearOrigin,), {"action_mask": mask})())
    with pytest.raises(ParameterError, match=message):
        swarm.reset(seed=1)


def test_declarations_that_cannot_be_are_refused():
    with pytest.raises(ParameterError, match="action_mask needs actions with levels"):
        type("Wrong", (Flee,), {"action_mask": lambda self, now: True})()
    with pytest.raises(ParameterError, match="state = 3 is not allowed; it takes a Computed or None"):
        Flee(state=3)
    with pytest.raises(ParameterError, match=r"policies: there is no block 'preys'.*prey"):
        Flee(policies={"preys": "a"})
    empty = [b.replace(count=0) if b.name == "hunters" else b for b in Flee().given.blocks]
    with pytest.raises(
        ParameterError, match="the observation has no numbers: the blocks that it observes have no"
    ):
        Flee(mission=Flee().given.replace(blocks=empty), observation=Each("hunters"))
    with pytest.raises(ParameterError, match="observation of 'prey' is empty"):
        Flee(observation={"near": (NearestOthers(2),), "own": ()})
    with pytest.raises(
        ParameterError, match=r"state: the function returns shape \(2,\); it returns \(2, 3\)"
    ):
        make_swarm(Flee(state=Computed(3, lambda simulation: simulation.t)), 2).reset(seed=1)


# -- observations with named parts, and states ----------------------------------------------------------------------------------------


def test_named_parts_are_the_columns_of_the_same_components():
    names = {"self": Own("vel", scale=20.0), "others": [NearestOthers(3), Own("pos")]}
    named, plain = (make_swarm(Flee(observation=o), 2) for o in (names, [names["self"], *names["others"]]))
    assert named.reset(seed=1).tobytes() == plain.reset(seed=1).tobytes()
    env = make(Flee(observation=names))
    obs, _ = env.reset(seed=1)
    np.testing.assert_array_equal(np.concatenate([obs["self"], obs["others"]], axis=-1), plain.obs[0])
    per_block = make_swarm(Flee(observation={"prey": names}), 2)
    assert per_block.reset(seed=1).tobytes() == plain.obs.tobytes()


def test_without_a_state_of_the_task_critics_see_all_observations(task):
    env = parallel_env(task)
    obs, _ = env.reset(seed=1)
    assert env.state_space.contains(env.state())
    np.testing.assert_array_equal(env.state(), np.concatenate(list(obs.values())))


def test_the_state_at_the_end_of_an_episode_is_kept():
    task = Flee(state=Computed(1, lambda simulation: simulation.t[:, None]), time_limit=0.5)
    swarm = make_swarm(task, 2)
    swarm.reset(seed=1)
    for _ in range(5):
        swarm.step(np.zeros((2, 6, 2)))
    assert swarm.over.all()
    np.testing.assert_allclose(swarm.final_central_state[:, 0], 0.5)
    np.testing.assert_allclose(swarm.central_state[:, 0], 0.0)


# -- policies by block ----------------------------------------------------------------------------------------------------------------


def test_blocks_have_policies():
    task = PredatorsAndPrey()
    assert task.roles == {"prey": ["prey"], "keepers": ["keepers"], "switchers": ["switchers"]}
    assert {task.policy_of(name) for name in task.agent_names} == set(task.roles)
    assert task.policy_of("switchers_4") == "switchers"
    shared = PredatorsAndPrey(policies={"keepers": "hunt", "switchers": "hunt"})
    assert shared.roles == {"prey": ["prey"], "hunt": ["keepers", "switchers"]}
    assert Flee().roles == {"": ["prey"]}
    with pytest.raises(
        ParameterError, match="the blocks prey keepers of 'all' observe or decide differently"
    ):
        _ = PredatorsAndPrey(policies={"prey": "all", "keepers": "all"}).roles
    with pytest.raises(ParameterError, match="no agent 'prey_100'"):
        task.policy_of("prey_100")
    assert evaluate(task.replace(time_limit=1.0), n_episodes=1).keys() == {"captures", "captured", "return"}


@pytest.mark.parametrize(
    "shared",
    [
        lambda now: now.pos,
        lambda now: now.yaw,
        lambda now: now.nearest().distance,
        lambda now: now.nearest().offset,
        lambda now: now.nearest("hunters", k=2).found,
        lambda now: now.n_within(50.0),
    ],
)
def test_no_term_changes_what_the_others_see(shared):
    def changing(now):
        shared(now)[:] = 1.0

    swarm = make_swarm(Flee(reward={"changing": Term(changing)}))
    swarm.reset(seed=1)
    with pytest.raises(ValueError, match="read-only"):
        swarm.step(np.zeros((1, len(swarm.task.agent_names), 2), np.float32))
