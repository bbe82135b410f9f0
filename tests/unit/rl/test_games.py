"""The tasks that come with tussle are the games that they say."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest

from tussle.rl import Consensus, PredatorsAndPrey, PredatorTeam, make_swarm


@pytest.mark.parametrize(
    ("name", "shape"), [("tussle/RLSimple-v0", (2,)), ("tussle/RLConsensus-v0", (10, 10))]
)
def test_the_games_of_scrimmage_are_registered(name, shape):
    env = gymnasium.make(name, disable_env_checker=True)
    obs, _ = env.reset(seed=1)
    assert obs.shape == shape
    env.close()


def test_a_robot_that_goes_to_the_origin_is_rewarded_there():
    env = gymnasium.make("tussle/RLSimple-v0", disable_env_checker=True)
    obs, _ = env.reset(seed=1)
    start, rewards, is_over = float(obs[0]), [], False
    while not is_over:
        before = obs.copy()
        action = int(obs[0] < 0)
        obs, reward, terminated, truncated, _ = env.step(action)
        assert (
            obs == pytest.approx([before[0] + (1 if action else -1), before[1] + 1], abs=1e-5)
            or terminated
            or truncated
        )
        rewards.append(reward)
        is_over = terminated or truncated
    assert truncated
    assert len(rewards) == 100
    assert abs(start) > 2.5
    far = int(abs(start) - 1.5)
    assert rewards == [0.0] * far + [1.0] * (100 - far)
    env.close()


def test_consensus_rewards_the_share_of_near_others():
    swarm = make_swarm(Consensus(), 3)
    obs = swarm.reset(seed=4)
    assert obs.shape == (3, 10, 10)
    actions = np.where(np.asarray(obs)[:, 0] < 0, 1, 0)
    for _ in range(60):
        obs, reward, *_ = swarm.step(actions)
        x = np.array(obs)[:, 0]
        wanted = ((np.abs(x[:, :, None] - x[:, None]) < 2).sum(axis=-1) - 1) / 10
        np.testing.assert_allclose(reward, wanted, atol=1e-6)
        actions = np.where(x < 0, 1, 0)
    assert np.asarray(reward).mean() > 0.5


def test_the_team_observes_the_direction_of_prey_and_earns_captures():
    task = PredatorTeam(time_limit=20.0)
    start = [
        b.replace(position=(0.0, 0.0, 200.0), half_width=(300.0, 300.0, 50.0)) if b.team == 3 else b
        for b in task.given.blocks
    ]
    with make_swarm(PredatorTeam(mission=task.given.replace(blocks=start), time_limit=20.0), 4) as swarm:
        obs = swarm.reset(seed=1)
        earned = 0.0
        for _ in range(100):
            directions = obs[..., 3:27].reshape(4, 5, 3, 8)[..., :3]
            lengths = np.linalg.norm(directions, axis=-1)
            np.testing.assert_allclose(lengths[lengths > 0], 1.0, rtol=1e-5)
            actions = np.clip(1.5 * directions[..., 0, 1:], -1, 1)  # turn and pitch towards the nearest
            obs, *_ = swarm.step(actions)
            earned += swarm.terms["captures"].sum()
        pos, _ = swarm.simulation.read("switchers.pos")
    assert earned > 3
    assert np.isfinite(pos).any()


def test_policies_of_either_side_play_where_all_learn():
    pytest.importorskip("onnxruntime", reason="onnxruntime is not installed: pip install 'tussle[policy]'")
    pytest.importorskip("onnx", reason="onnx is not installed: pip install 'tussle[policy]'")
    from tussle.plugins.stock.autonomy.learned import policy_path
    from tussle.rl.flight import Policy

    hunt, flee = Policy(policy_path("predator_team")), Policy(policy_path("prey_escape"))

    def captures(flees):
        with make_swarm(PredatorsAndPrey(time_limit=60.0), 2) as swarm:
            obs, n_captures, n_prey = swarm.reset(seed=1), 0.0, swarm.task.capacities[0]
            actions = np.zeros((2, swarm.n_agents, swarm.action_width), np.float32)
            sides = [(hunt, slice(n_prey, None)), *([(flee, slice(n_prey))] if flees else [])]
            for _ in range(300):
                for policy, who in sides:
                    seen = obs[:, who, : policy.width]
                    out, _ = policy(seen.reshape(-1, policy.width), np.zeros((seen[..., 0].size, 0)))
                    actions[:, who] = out.clip(-1.0, 1.0).reshape(*seen.shape[:2], -1)
                obs, *_ = swarm.step(actions)
                n_captures += swarm.terms["captures"].sum()
                assert swarm.terms["captures"].sum() == -swarm.terms["captured"].sum()
            return n_captures

    assert captures(flees=False) > captures(flees=True) + 5.0
