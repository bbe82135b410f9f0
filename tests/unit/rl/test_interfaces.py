"""The checkers of Gymnasium, PettingZoo and SuperSuit hold for tasks."""

import re
import types
import warnings
from dataclasses import replace

import gymnasium
import needs
import numpy as np
import pytest
from flee import Flee
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode
from pettingzoo.utils import parallel_to_aec

from tussle.errors import ParameterError, TussleError
from tussle.rl import (
    Act,
    Computed,
    Own,
    Sectors,
    TaskParallelEnv,
    Term,
    alive,
    evaluate,
    make,
    make_vec,
    parallel_env,
    register,
    write_policy,
)  # fmt: skip


@pytest.mark.parametrize("which", ["task", "solo"])
def test_gymnasium_accepts_one_world(which, request):
    env = make(request.getfixturevalue(which))
    with warnings.catch_warnings():
        warnings.filterwarnings(
            "ignore", message=".*(Box observation space (minimum|maximum)|unconventional).*"
        )
        check_env(env, skip_render_check=True)
    env.close()


def test_pettingzoo_accepts_agents_that_die(task):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of PettingZoo itself
        from pettingzoo.test import api_test, max_cycles_test, parallel_api_test, parallel_seed_test

        parallel_api_test(parallel_env(task), num_cycles=200)
        parallel_seed_test(lambda: parallel_env(task), num_cycles=30)
        api_test(parallel_to_aec(parallel_env(task)), num_cycles=60)
    make = types.SimpleNamespace(
        parallel_env=lambda max_cycles: parallel_env(task.replace(time_limit=max_cycles * 0.1)),
        env=lambda max_cycles: parallel_to_aec(parallel_env(task.replace(time_limit=max_cycles * 0.1))),
    )
    max_cycles_test(make)


def test_agents_leave_when_they_die(task):
    env = parallel_env(task)
    obs, _ = env.reset(seed=3)
    assert list(obs) == env.agents == env.possible_agents
    n_dead, totals, n_steps = 0, dict.fromkeys(env.agents, 0.0), 0
    while env.agents:
        before = list(env.agents)
        n_steps += 1
        obs, rewards, dead, late, infos = env.step({a: np.zeros(2, np.float32) for a in before})
        assert list(obs) == list(rewards) == list(dead) == list(late) == list(infos) == before
        n_dead += sum(dead.values())
        for a in before:
            totals[a] += rewards[a]
            ended = {"episode": {"r": pytest.approx(totals[a]), "l": n_steps}} if dead[a] or late[a] else {}
            assert infos[a] == ended
        assert set(env.agents) == {a for a in before if not dead[a] and not late[a]}
        assert all((rewards[a] < 0) == dead[a] for a in before)
    assert n_dead > 0


def test_actions_that_do_not_fit_are_refused(task):
    env = parallel_env(task)
    env.reset(seed=3)
    good = {a: np.zeros(2, np.float32) for a in env.agents}
    wrong = {
        "missing": {a: v for a, v in good.items() if a != "prey_2"},
        "no agent .did you mean 'prey_2'": {**good, "pray_2": good["prey_2"]},
        "float32 of shape \\(3,\\)": {**good, "prey_2": np.zeros(3, np.float32)},
        "int64 of shape": {**good, "prey_2": np.zeros(2, np.int64)},
        "prey_2 in world 0 is \\[nan": {**good, "prey_2": np.array([np.nan, 0.0], np.float32)},
    }
    for message, actions in wrong.items():
        with pytest.raises(ParameterError, match=message):
            env.step(actions)
    while "prey_0" in env.agents:
        env.step({a: np.zeros(2, np.float32) for a in env.agents})
    if env.agents:
        with pytest.raises(ParameterError, match="'prey_0', which is not alive"):
            env.step({a: np.zeros(2, np.float32) for a in [*env.agents, "prey_0"]})
    vec = make_vec(task, 2)
    vec.reset(seed=1)
    for actions, message in [
        (np.zeros((2, 5, 2), np.float32), "shape"),
        (np.zeros((2, 6, 2), np.int64), "floating-point"),
        (np.full((2, 6, 2), np.nan, np.float32), "prey_0 in world 0"),
    ]:
        with pytest.raises(ParameterError, match=message):
            vec.step(actions)


@pytest.mark.parametrize("space", ["observation_space", "action_space"])
@pytest.mark.parametrize("wrong", ["pray_2", "", 2, None, ["prey_2"]])
def test_a_space_of_nobody_names_who_there_is(task, space, wrong):
    for env in (parallel_env(task), parallel_to_aec(parallel_env(task))):
        near = r" \(did you mean 'prey_2'\?\)" if isinstance(wrong, str | list) and wrong else ""
        text = rf"^{re.escape(repr(wrong))} is no agent{near}; there are: prey_0, .*prey_5$"
        with pytest.raises(ParameterError, match=text):
            getattr(env, space)(wrong)


RAGGED = [[1.0, 2.0], [3.0]]


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda task: make(task).step(RAGGED), "the action: no array can be made of it"),
        (lambda task: make_vec(task, 2).step(RAGGED), "actions: no array can be made of it"),
        (lambda task: begun(task).step(None), "actions = None is not allowed; it takes an action by the name"),
        (lambda task: begun(task).step(dict.fromkeys(begun(task).agents, RAGGED)), "the action of 'prey_0': no array"),
        (lambda task: make(task).reset(options=["params"]), r"options = \['params'\] is not allowed; it takes values by name"),
        (lambda task: begun(task).swarm.restore(5), "restore: state = 5 is not allowed; it takes values by name"),
        (lambda task: begun(task).swarm.restore({}), "restore takes what `snapshot` returned"),
        (lambda task: begun(task).swarm.now.nearest(of=["prey"]), r"nearest: of = \['prey'\] is not allowed"),
        (lambda task: begun(task).swarm.now.n_living(["prey"]), r"n_living: of = \['prey'\] is not allowed"),
        (lambda task: make_vec(task, np.nan), "num_envs = nan is not allowed; it takes a whole number >= 1"),
        (lambda task: evaluate(task, 5), "policy = 5 is not allowed; it takes a function or None"),
        (lambda task: evaluate(task, None, "x"), "n_episodes = 'x' is not allowed; it takes a whole number >= 1"),
        (lambda task: register("mine/Five-v0", 5), "5 is not a Task"),
        (lambda task: register(5, task), "name = 5 is not allowed; it takes a text"),
        (lambda task: write_policy(5, [([[1.0]], [0.0])]), "path = 5 is not allowed; it takes a text or a Path"),
        (lambda task: write_policy("x", [("a", "b")]), "layers are no arrays of numbers"),
        (lambda task: task.replace(dtype="x"), "dtype = 'x' is not allowed; it is float32 or float64"),
        (lambda task: task.replace(dtype=None), "dtype = None is not allowed"),
        (lambda task: task.replace(vary="a=1:2"), "vary = 'a=1:2' is not allowed; it takes a list, each a text or values by name"),
        (lambda task: task.replace(vary=5), "vary = 5 is not allowed"),
        (lambda task: task.replace(margin=5), "margin = 5 is not allowed; it takes a text"),
        (lambda task: task.replace(is_symmetric="x"), "is_symmetric = 'x' is not allowed; it takes true or false"),
        (lambda task: task.replace(room={"prey": 0}), "'prey' has no agents; give the blocks a count, or room"),
        (lambda task: task.replace(observation=Own("pos", origin=3)), "Own: origin = 3 is not allowed; it takes 3 values"),
        (lambda task: task.replace(observation=Own(5)), "Own: columns = 5 is not allowed; it takes a text"),
        (lambda task: task.replace(observation=Own("pos", scale="x")), "Own: scale = 'x' is not allowed; it takes a number"),
        (lambda task: task.replace(observation=Sectors(4, None)), "Sectors: radius = None is not allowed; it takes a number"),
        (lambda task: task.replace(observation=Computed(0, len)), "Computed: n = 0 is not allowed; it takes a whole number >= 1"),
        (lambda task: task.replace(action=Act("speed turn_rate", levels=RAGGED)), "levels: no array can be made of it"),
        (lambda task: task.replace(action=Act("speed", levels=5)), "Act: levels = 5 is not allowed; it takes a list"),
    ],
)  # fmt: skip
def test_what_is_of_another_type_is_refused_by_name(call, text, task):
    with pytest.raises(TussleError, match=text):
        call(task)


def begun(task):
    env = parallel_env(task)
    env.reset(seed=1)
    return env


def test_supersuit_makes_a_vector_environment(task):
    needs.require("supersuit")
    supersuit = pytest.importorskip("supersuit")  # warnings of its modules are none of the test
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        env = supersuit.black_death_v3(parallel_env(task))
        env = supersuit.frame_stack_v1(env, 2)
        vec = supersuit.concat_vec_envs_v1(supersuit.pettingzoo_env_to_vec_env_v1(env), 2, num_cpus=0)
        obs, _ = vec.reset(seed=1)
        assert obs.shape == (12, 2 * 27)
        for _ in range(70):
            obs, *_ = vec.step(np.zeros((12, 2), np.float32))
        assert np.isfinite(obs).all()


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_vector_environments_reset_as_gymnasium_says(solo, mode):
    vec, alone = make_vec(solo, 3, autoreset=mode), make(solo)
    assert vec.metadata["autoreset_mode"] == mode
    first, _ = vec.reset(seed=[5, 6, 7])
    assert vec.observation_space.contains(first)
    seen, _ = alone.reset(seed=6)
    np.testing.assert_array_equal(seen, first[1])
    is_over, n_ends = False, 0
    for k in range(150):
        actions = np.full((3, 2), np.sin(k), np.float32)
        obs, rewards, terminated, truncated, info = vec.step(actions)
        if mode == AutoresetMode.NEXT_STEP and is_over:
            seen, _ = alone.reset()
            assert rewards[1] == 0.0
            assert not terminated[1]
            is_over = False
        else:
            seen, reward, dead, late, _ = alone.step(actions[1])
            assert (reward, dead, late) == (rewards[1], terminated[1], truncated[1])
            is_over = dead or late
            n_ends += is_over
        if mode == AutoresetMode.SAME_STEP and is_over:
            np.testing.assert_array_equal(info["final_obs"][1], seen)
            assert info["_final_obs"][1]
            seen, _ = alone.reset()
        if mode == AutoresetMode.DISABLED and (terminated | truncated).any():
            mask = terminated | truncated
            obs, _ = vec.reset(options={"reset_mask": mask})
            if mask[1]:
                seen, _ = alone.reset()
        np.testing.assert_array_equal(obs[1], seen)
    assert n_ends > 1


def test_tasks_are_registered():
    env = gymnasium.make("tussle.rl:tussle/PredatorPrey-v0", disable_env_checker=True)
    obs, _ = env.reset(seed=1)
    assert obs.shape == (100, 73)
    env.close()


@pytest.mark.needs("renderer")
def test_pictures_show_the_world(task):
    pytest.importorskip("pyvista")
    env = TaskParallelEnv(task, render_mode="rgb_array")
    env.reset(seed=1)
    picture = env.render()
    assert picture.dtype == np.uint8
    assert picture.shape == (480, 640, 3)
    assert picture.std() > 1.0
    env.close()
    with pytest.raises(ParameterError, match="render_mode"):
        make(task, render_mode="ascii")


def test_agents_join_when_they_are_born(task):
    """Two slots of births: these agents come later; agents that are not there take no actions and get no rewards."""
    given = task.mission
    prey, hunters = given.blocks
    late = replace(prey, name="late", rate=1.0, slots=2)
    env = parallel_env(
        task.replace(mission=replace(given, blocks=(prey, late, hunters)), learners="prey late")
    )
    obs, _ = env.reset(seed=3)
    n_born, seen = 0, set(env.agents)
    assert 0 < len(seen) < len(env.possible_agents)
    while env.agents:
        before = set(env.agents)
        obs, rewards, dead, late_, infos = env.step({a: np.zeros(2, np.float32) for a in env.agents})
        assert set(obs) == set(rewards) == set(dead) == set(infos)
        born = set(obs) - before
        assert not born & seen
        assert all(np.abs(obs[a]).max() > 0 for a in born)
        assert set(env.agents) == {a for a in obs if not dead[a] and not late_[a]}
        n_born, seen = n_born + len(born), seen | born
    assert n_born > 1
    assert seen <= set(env.possible_agents)


def test_an_episode_may_begin_without_agents(task):
    prey, hunters = task.mission.blocks
    late = replace(prey, rate=1.0, slots=2, first_birth=1.0)
    env = parallel_env(task.replace(mission=replace(task.mission, blocks=(late, hunters))))
    env.reset(seed=3)
    n_empty = 0
    while not env.agents:
        assert env.step({})[0].keys() == set(env.agents)
        n_empty += 1
    assert n_empty >= 10
    while env.agents or not env.swarm.over[0]:
        env.step({a: np.zeros(2, np.float32) for a in env.agents})
    assert env.step({}) == ({}, {}, {}, {}, {})


@pytest.mark.parametrize("name", ["alive", "seed", "params", "terms", "episode", "final_obs"])
def test_a_term_may_have_any_name(name):
    """Infos tell the same, whatever the terms of the reward are called."""

    def infos(term):
        task = Flee(reward={term: Term(alive, 0.5)}, vary=["prey.Unicycle.vel_max=10:20"], time_limit=0.3)
        env, envs = make(task), make_vec(task, 2, autoreset="same_step")
        action = np.zeros((6, 2), np.float32)
        found = [env.reset(seed=1)[1], envs.reset(seed=1)[1]]
        for _ in range(3):
            found += [env.step(action)[4], envs.step(np.stack([action, action]))[4]]
        return found

    def told(info):
        info = {key: value for key, value in info.items() if key not in ("terms", "final_info")}
        return {key: repr(value) for key, value in info.items()}

    mine, others = infos(name), infos("plain")
    assert [told(info) for info in mine] == [told(info) for info in others]
    assert mine[2]["terms"] == {name: 3.0}
    assert mine[3]["terms"][name].tolist() == [3.0, 3.0]
    last = mine[-1]["final_info"]
    assert told(last) == told(others[-1]["final_info"])
    assert last["terms"][name].tolist() == [3.0, 3.0]


def test_masks_of_infos_are_not_the_names_of_terms():
    with pytest.raises(ParameterError, match=r"reward '_alive'.*does not begin with _"):
        Flee(reward={"alive": Term(alive), "_alive": Term(alive)})
