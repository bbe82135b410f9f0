"""Trainers that others wrote take tasks as they are: stable-baselines3, through SuperSuit too, and one file in the way of CleanRL."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from needs import NEEDS, require

from tussle.rl import (
    NearOrigin,
    PredatorsAndPrey,
    ReachPoint,
    SimpleTag,
    evaluate,
    make,
    make_swarm,
    make_vec,
    parallel_env,
)

torch = pytest.importorskip("torch", reason=NEEDS["torch"].reason)


@pytest.fixture
def one_thread():
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    torch.manual_seed(1)
    yield
    torch.set_num_threads(before)


@pytest.mark.parametrize("which", ["task", "solo"])
def test_stable_baselines3_accepts_one_world(which, request):
    checker = pytest.importorskip(
        "stable_baselines3.common.env_checker", reason=NEEDS["stable_baselines3"].reason
    )
    env = make(request.getfixturevalue(which))
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=".*unconventional shape.*")
        checker.check_env(env, skip_render_check=True)
    env.close()


@pytest.mark.slow
@pytest.mark.usefixtures("one_thread")
def test_ppo_of_stable_baselines3_learns_in_a_task():
    baselines = pytest.importorskip("stable_baselines3", reason=NEEDS["stable_baselines3"].reason)
    env = make(NearOrigin)
    model = baselines.PPO(
        "MlpPolicy", env, n_steps=500, batch_size=100, learning_rate=3e-3, seed=1, device="cpu"
    )
    model.learn(6_000)

    def policy(obs):
        return model.predict(obs[:, 0], deterministic=True)[0].reshape(-1, 1, 1)

    def chance(obs):
        return random.integers(0, 2, (len(obs), 1, 1))

    random = np.random.default_rng(1)
    learned, by_chance = (
        evaluate(NearOrigin, each, 50, seed=1000)["return"].mean() for each in (policy, chance)
    )
    assert learned > by_chance + 20
    env.close()


@pytest.mark.usefixtures("one_thread")
def test_ppo_of_stable_baselines3_plays_all_agents_through_supersuit(task):
    """The lines of docs/learning.md."""
    baselines = pytest.importorskip("stable_baselines3", reason=NEEDS["stable_baselines3"].reason)
    require("supersuit")
    supersuit = pytest.importorskip("supersuit")  # warnings of its modules are none of the test
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of SuperSuit itself
        env = supersuit.black_death_v3(parallel_env(task))
        envs = supersuit.concat_vec_envs_v1(
            supersuit.pettingzoo_env_to_vec_env_v1(env), 8, base_class="stable_baselines3"
        )
        model = baselines.PPO("MlpPolicy", envs, n_steps=60, batch_size=480, n_epochs=1, device="cpu")
        before = [each.clone() for each in model.policy.parameters()]
        model.learn(2 * 60 * 48)
        assert model.num_timesteps == 2 * 60 * 48
        assert any((a != b).any() for a, b in zip(before, model.policy.parameters(), strict=True))
        assert np.isfinite([each["r"] for each in model.ep_info_buffer]).all()
        envs.close()


class Agent(torch.nn.Module):
    """Mean, standard deviation and value, as in the script of CleanRL."""

    def __init__(self, envs):
        super().__init__()
        n_in, n_out = np.prod(envs.single_observation_space.shape), np.prod(envs.single_action_space.shape)
        self.critic, self.mean = (
            torch.nn.Sequential(
                torch.nn.Linear(int(n_in), 64), torch.nn.Tanh(), torch.nn.Linear(64, 64), torch.nn.Tanh(), torch.nn.Linear(64, int(n))
            )
            for n in (1, n_out)
        )  # fmt: skip
        self.log_std = torch.nn.Parameter(torch.zeros(1, int(n_out)))

    def forward(self, obs, action=None):
        normal = torch.distributions.Normal(self.mean(obs), self.log_std.exp().expand(len(obs), -1))
        action = normal.sample() if action is None else action
        return action, normal.log_prob(action).sum(1), self.critic(obs)[:, 0]


def improve(agent, optimizer, batch, n_epochs=10, n_parts=8):
    """Epochs of the clipped objective over minibatches."""
    obs, actions, log_prob, gain, returns = batch
    for _ in range(n_epochs):
        for some in torch.randperm(len(obs)).chunk(n_parts):
            _, new_log_prob, value = agent(obs[some], actions[some])
            ratio = (new_log_prob - log_prob[some]).exp()
            advantage = (gain[some] - gain[some].mean()) / (gain[some].std() + 1e-8)
            loss = torch.max(-advantage * ratio, -advantage * ratio.clamp(0.8, 1.2)).mean()
            loss = loss + 0.5 * 0.5 * (value - returns[some]).square().mean()
            optimizer.zero_grad()
            loss.backward()
            torch.nn.utils.clip_grad_norm_(agent.parameters(), 0.5)
            optimizer.step()


@pytest.mark.usefixtures("one_thread")
def test_a_script_in_the_way_of_cleanrl_learns_on_make_vec():
    """CleanRL's documented loop for continuous actions (Huang and others 2022): gymnasium's wrappers, next-step autoreset, GAE, PPO."""
    import gymnasium

    n_worlds, n_steps, gamma, trace = 16, 128, 0.99, 0.95
    envs = gymnasium.wrappers.vector.RecordEpisodeStatistics(make_vec(ReachPoint, n_worlds))
    envs = gymnasium.wrappers.vector.ClipAction(envs)
    agent = Agent(envs)
    optimizer = torch.optim.Adam(agent.parameters(), lr=1e-3, eps=1e-5)
    returns_of_episodes = []
    next_obs, next_done = torch.tensor(envs.reset(seed=1)[0]), torch.zeros(n_worlds)
    for _ in range(40):
        obs = torch.zeros(n_steps, *next_obs.shape)
        actions = torch.zeros(n_steps, n_worlds, 2)
        log_prob, rewards, dones, values = torch.zeros(4, n_steps, n_worlds)
        for t in range(n_steps):
            obs[t], dones[t] = next_obs, next_done
            with torch.no_grad():
                actions[t], log_prob[t], values[t] = agent(next_obs)
            seen, reward, terminated, truncated, info = envs.step(actions[t].numpy())
            rewards[t] = torch.tensor(reward)
            next_obs, next_done = torch.tensor(seen), torch.tensor(terminated | truncated).float()
            if "episode" in info:
                returns_of_episodes += list(info["episode"]["r"][info["_episode"]])
        with torch.no_grad():
            later, gain = agent(next_obs)[2], torch.zeros(n_worlds)
        gains, goes_on = torch.zeros(n_steps, n_worlds), 1.0 - next_done
        for t in reversed(range(n_steps)):
            gain = rewards[t] + gamma * later * goes_on - values[t] + gamma * trace * goes_on * gain
            gains[t], later, goes_on = gain, values[t], 1.0 - dones[t]
        batch = (
            obs.flatten(0, 1),
            actions.flatten(0, 1),
            log_prob.flatten(),
            gains.flatten(),
            (gains + values).flatten(),
        )
        improve(agent, optimizer, batch)
    envs.close()
    first, last = np.mean(returns_of_episodes[:n_worlds]), np.mean(returns_of_episodes[-n_worlds:])
    assert last > first + 0.3


def test_torchrl_takes_agents_groups_and_dead_agents():
    """Its wrappers check our specifications; groups are the roles of a task."""
    environments = pytest.importorskip("torchrl.envs", reason="TorchRL is not installed")
    check_env_specs = pytest.importorskip("torchrl.envs.utils").check_env_specs
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of TorchRL itself
        check_env_specs(environments.GymWrapper(make(ReachPoint)))
        check_env_specs(environments.PettingZooWrapper(parallel_env(SimpleTag())))
        task = PredatorsAndPrey(time_limit=5.0)
        groups = {role: [a for a in task.agent_names if task.policy_of(a) == role] for role in task.roles}
        env = environments.PettingZooWrapper(parallel_env(task), use_mask=True, group_map=groups)
        rollout = env.rollout(5)
    assert rollout["prey", "observation"].shape == (5, 100, 46)
    assert rollout["keepers", "observation"].shape == (5, 5, 32)


def test_rllib_takes_agents_and_the_mapping_of_their_policies():
    """Its wrapper of PettingZoo; its own runs need a cluster of Ray."""
    wrappers = pytest.importorskip("ray.rllib.env.wrappers.pettingzoo_env", reason="RLlib is not installed")
    task = PredatorsAndPrey(time_limit=2.0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of RLlib itself
        env = wrappers.ParallelPettingZooEnv(parallel_env(task))
    obs, _ = env.reset(seed=1)
    n_steps, ended = 0, {"__all__": False}
    while not ended["__all__"]:
        assert {task.policy_of(agent) for agent in obs} == set(task.roles)
        actions = {agent: env.get_action_space(agent).sample() for agent in obs}
        obs, rewards, terminated, truncated, _ = env.step(actions)
        ended = {name: terminated[name] or truncated[name] for name in ("__all__",)}
        assert rewards.keys() == actions.keys()
        n_steps += 1
    assert n_steps == task.n_steps // task.decide_every


def test_arrays_keep_their_place_as_vectorised_trainers_expect():
    """PufferLib's environments write agents of all worlds, one after another, to buffers that stay: those of a swarm do."""
    swarm = make_swarm(SimpleTag(time_limit=0.5), 8)
    swarm.reset(seed=1)
    buffers = [swarm.obs, swarm.rewards, swarm.terminations, swarm.truncations]
    flat = [each.reshape(32, -1) for each in buffers]
    for _ in range(12):
        results = swarm.step(np.ones((8, 4), int))
        for buffer, rows, result in zip(buffers, flat, results, strict=False):
            assert result is buffer
            assert np.shares_memory(rows, result)
            np.testing.assert_array_equal(rows, result.reshape(32, -1))
