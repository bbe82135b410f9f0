"""Games of particles are those of MPE2: the same first states and actions give the same trajectories, observations and rewards."""

import importlib
import warnings

import numpy as np
import pytest

from tussle.rl import SimpleAdversary, SimpleSpread, SimpleTag, make_swarm

GAMES = {"simple_tag_v3": SimpleTag, "simple_spread_v3": SimpleSpread, "simple_adversary_v3": SimpleAdversary}


def peer_of(name, seed):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        module = pytest.importorskip(f"mpe2.{name}")
        peer = importlib.import_module(module.__name__).parallel_env(max_cycles=2000)
        peer.reset(seed=seed)
    return peer


@pytest.mark.parametrize("name", GAMES)
@pytest.mark.parametrize("seed", [4, 5])
def test_trajectories_are_those_of_mpe2(name, seed):
    peer = peer_of(name, seed)
    swarm = make_swarm(GAMES[name](time_limit=200.0, dtype=np.float64), 2, autoreset="disabled")
    inner = peer.aec_env.unwrapped
    world = inner.world
    goals = {id(a.goal_a) for a in world.agents if hasattr(a, "goal_a")}
    params = (
        {"GoalLandmark.number": next(k for k, mark in enumerate(world.landmarks) if id(mark) in goals)}
        if goals
        else {}
    )
    swarm.reset(seed=4, params=params)
    entities = [*world.agents, *world.landmarks]
    for block in swarm.task.given.blocks:
        mine = [e for e in entities if e.name.replace(" ", "_").rpartition("_")[0] == block.name]
        pos, _ = swarm.simulation.read(f"{block.name}.pos")
        pos[1, :, :2] = [entity.state.p_pos for entity in mine]
        swarm.simulation.write(f"{block.name}.pos", pos)
    names, n = swarm.task.agent_names, len(world.agents)
    assert names == peer.agents
    chance, n_rewards = np.random.default_rng(seed), set()
    held = chance.integers(0, 5, n)
    for k in range(500):
        held = np.where(chance.random(n) < 0.2, chance.integers(0, 5, n), held)
        if k % 3 == 0:  # they meet, so that there are contacts
            offset = [np.subtract(world.agents[-1].state.p_pos, a.state.p_pos) for a in world.agents[:-1]]
            held[:-1] = [(1 if x < 0 else 2) if abs(x) > abs(y) else (3 if y < 0 else 4) for x, y in offset]
        _, gained, *_ = peer.step(dict(zip(names, held.tolist(), strict=True)))
        obs, rewards, *_ = swarm.step(np.stack([held, held]))
        for a in range(n):  # the environment rounds to float32
            seen = inner.scenario.observation(world.agents[a], world)
            np.testing.assert_allclose(obs[1, a, : len(seen)], seen, rtol=0, atol=1e-9)
            assert swarm.task.observation_space(a).shape == seen.shape
        here = np.concatenate(
            [swarm.simulation.read(f"{b.name}.pos")[0][1, :, :2] for b in swarm.task.given.blocks]
        )
        np.testing.assert_allclose(here, [e.state.p_pos for e in entities], rtol=0, atol=1e-9)
        np.testing.assert_allclose(rewards[1], [gained[name] for name in names], rtol=0, atol=1e-9)
        n_rewards.add(round(gained[names[0]], 9))
    assert len(n_rewards) > (1 if name == "simple_tag_v3" else 100)


def test_an_episode_has_25_steps_and_spaces_are_those_of_mpe2():
    for name, task in GAMES.items():
        peer, mine = peer_of(name, 1), task()
        assert mine.n_steps == 25
        for a, agent in enumerate(mine.agent_names):
            assert mine.action_space(a).n == peer.action_space(agent).n
            assert mine.observation_space(a).shape == peer.observation_space(agent).shape


def test_the_goal_is_drawn_per_episode_and_unknown_to_the_adversary():
    swarm = make_swarm(SimpleAdversary(), 64)
    obs = swarm.reset(seed=1)
    goals = swarm.params["GoalLandmark.number"]
    assert 16 < goals.sum() < 48
    blind = obs[:, 0].copy()
    np.testing.assert_allclose(
        obs[np.arange(64)[:, None], 1, :2],
        np.take_along_axis(obs[:, 1, 2:6].reshape(64, 2, 2), goals[:, None, None], 1),
    )
    seeds = swarm.seeds.tolist()
    other = make_swarm(SimpleAdversary(), 64)
    np.testing.assert_array_equal(
        other.reset(seeds, params={"GoalLandmark.number": (1 - goals).tolist()})[:, 0], blind
    )
