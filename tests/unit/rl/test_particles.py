"""Games of particles are those of MPE2 and VMAS: the same first states and actions give the same trajectories, observations and rewards."""

import importlib
import warnings

import needs
import numpy as np
import pytest

from tussle.rl import Dispersion, SimpleAdversary, SimpleSpread, SimpleTag, make_swarm

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


@pytest.mark.needs("vmas")
def test_trajectories_of_dispersion_are_those_of_vmas(monkeypatch):
    torch = pytest.importorskip("torch", reason=needs.NEEDS["torch"].reason)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        vmas = importlib.import_module("vmas")
    monkeypatch.setattr(torch, "float32", torch.float64)  # it computes in what it calls so
    peer = vmas.make_env("dispersion", num_envs=3, continuous_actions=True, seed=1, device="cpu")
    seen = peer.reset()
    swarm = make_swarm(Dispersion(dtype=np.float64), 3, autoreset="disabled")
    swarm.reset(seed=1)
    pos, _ = swarm.simulation.read("food.pos")
    pos[..., :2] = np.stack([piece.state.pos.numpy() for piece in peer.world.landmarks], axis=1)
    swarm.simulation.write("food.pos", pos)
    chance, parts, is_over = np.random.default_rng(2), set(), torch.zeros(3)
    for k in range(99):
        if is_over.any():
            break
        own = np.stack([each[:, :2].numpy() for each in seen], axis=1)
        target = np.stack([each[:, 4 + 3 * a : 6 + 3 * a].numpy() for a, each in enumerate(seen)], axis=1)
        target[:, 1] = target[:, 0] + own[:, 0] - own[:, 1] if k < 40 else target[:, 1]  # two share a piece
        target[:, 3] = 1.0 if k < 60 else target[:, 3]  # one runs into the walls first
        actions = np.clip(5.0 * target + chance.normal(0.0, 0.3, (3, 4, 2)), -1.0, 1.0)
        seen, gained, is_over, _ = peer.step([torch.tensor(actions[:, a]) for a in range(4)])
        obs, rewards, terminated, *_ = swarm.step(actions)
        wanted = [np.stack([each.numpy() for each in several], axis=1) for several in (seen, gained)]
        np.testing.assert_allclose(obs, wanted[0], rtol=0, atol=1e-9)
        np.testing.assert_allclose(rewards, wanted[1], rtol=0, atol=1e-9)
        assert terminated.all(axis=1).tolist() == is_over.tolist()
        parts |= {*rewards.ravel().tolist()}
    assert is_over.any()
    assert {0.0, 0.5, 1.0} <= parts
