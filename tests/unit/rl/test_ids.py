"""What holds for every task that is registered, and for a task of one's own."""

import gymnasium
import numpy as np
import pytest
from flee import Flee

from tussle.errors import ParameterError
from tussle.rl import (
    Act,
    FindWay,
    Own,
    PredatorTeam,
    Task,
    Term,
    alive,
    evaluate,
    make_swarm,
    make_vec,
    parallel_env,
)
from tussle.rl.flight import registered_tasks

IDS = sorted(name for name in registered_tasks() if name.startswith("tussle/"))


def short(name):
    """A task of a few decisions."""
    task = gymnasium.spec(name).kwargs["task"]()
    return task.replace(time_limit=6.0 * task.given.dt * task.decide_every)


def test_all_tasks_are_here():
    assert len(IDS) == 16


@pytest.mark.parametrize("name", IDS)
def test_rules_play_every_task(name):
    task = short(name)
    sums = evaluate(task, n_episodes=2)
    assert sums.keys() == {*task.reward, "return"}
    assert all(np.isfinite(value).all() for value in sums.values())
    moved = make_swarm(task.by_rule(), 1)
    moved.reset(seed=1)
    before = moved.simulation.read(f"{task.blocks[0].name}.pos")[0].copy()
    moved.step(np.zeros((1, moved.n_agents, 0), task.dtype))
    assert (moved.simulation.read(f"{task.blocks[0].name}.pos")[0] != before).any()


class Claimed(Flee):
    """A task whose agents have no autonomy of their own in its mission."""

    mission = Flee.mission.replace(blocks=[b.replace(autonomy=()) for b in Flee.mission.blocks])


class Scripted(Claimed):
    scripted = Flee.mission


def test_who_plays_by_rule_is_of_the_mission_that_was_given_last():
    rules = evaluate(Scripted, n_episodes=2)
    assert rules["return"].tolist() == evaluate(Flee, n_episodes=2)["return"].tolist()
    again = Scripted(mission=Flee.mission.replace(end=2.0))
    assert evaluate(again, n_episodes=2)["alive"].max() < 6 * 21 * 0.1
    for task in (Claimed(), Scripted(mission=Claimed.mission), FindWay(mission=FindWay.mission)):
        with pytest.raises(ParameterError, match=rf"no autonomies play '{task.learners}' by rule.*give scripted ="):
            evaluate(task, n_episodes=2)
    team = PredatorTeam(mission="predator_prey", time_limit=1.0)
    assert evaluate(team, n_episodes=1)["closing"][0] != 0.0


def test_overrides_are_not_ignored():
    with pytest.raises(ParameterError, match=r"overrides = \{'prey.count': 3\} is not allowed with a mission made in Python"):
        make_swarm(Flee(overrides={"prey.count": 3}))
    swarm = make_swarm(PredatorTeam(overrides={"prey.count": 3}))
    assert swarm.simulation.read("prey.pos")[1].shape == (1, 3)


@pytest.mark.parametrize("name", IDS)
def test_the_last_step_of_an_episode_has_its_info(name):
    envs = make_vec(short(name), 2, autoreset="same_step")
    _, began = envs.reset(seed=[5, 6])
    envs.action_space.seed(1)
    for _ in range(6):
        *_, late, info = envs.step(envs.action_space.sample())
    assert late.all()
    last = info["final_info"]
    assert last["seed"].tolist() == [5, 6] == began["seed"].tolist()
    assert info["seed"].tolist() != [5, 6]
    assert info["_final_info"].all()
    for term, value in envs.swarm.terms.items():
        np.testing.assert_array_equal(last[term], value.sum(axis=1))
        assert last[f"_{term}"].all()


@pytest.mark.parametrize("name", [*IDS, "own"])
def test_observations_lie_in_their_space(name):
    task = Watched() if name == "own" else short(name)
    swarm = make_swarm(task, 3)
    swarm.reset(seed=1)
    chance = np.random.default_rng(1)
    spaces = [task.observation_space(a) for a in range(swarm.n_agents)]
    low, high = (np.stack([getattr(s, k) for s in spaces]) for k in ("low", "high")) if len(
        {s.shape for s in spaces}
    ) == 1 else (None, None)
    for _ in range(20):
        shape = 3, swarm.n_agents, swarm.action_width
        actions = chance.choice([-1.0, 1.0], shape).astype(task.dtype)
        swarm.step(actions if swarm.is_continuous else (actions > 0).astype(int))
        if low is not None:
            assert ((swarm.obs >= low) & (swarm.obs <= high)).all()
        else:
            for a, space in enumerate(spaces):
                assert all(space.contains(row[: space.shape[0]]) for row in swarm.obs[:, a])
