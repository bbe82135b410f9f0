"""The benchmark's game of tag is that of mpe2: the same positions and actions give the same trajectories, observations and rewards."""

import runpy
import warnings
from pathlib import Path

import numpy as np
import pytest

from tussle.rl import make_swarm

GAME = Path(__file__).parents[3] / "benchmarks" / "tag.py"
AGENTS = ("adversary_0", "adversary_1", "adversary_2", "agent_0")


def test_tag_is_that_of_mpe2():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        tag = pytest.importorskip("mpe2.simple_tag_v3")
        peer = tag.parallel_env(max_cycles=2000)
        peer.reset(seed=4)
    task = runpy.run_path(str(GAME))["Tag"](time_limit=200.0, dtype=np.float64)
    swarm = make_swarm(task, 2, autoreset="disabled")
    swarm.reset(seed=4)
    inner = peer.aec_env.unwrapped
    world = inner.world
    for name, entities in (
        ("adversary", world.agents[:3]),
        ("agent", world.agents[3:]),
        ("landmark", world.landmarks),
    ):
        pos, _ = swarm.simulation.read(f"{name}.pos")
        pos[1, :, :2] = [entity.state.p_pos for entity in entities]
        swarm.simulation.write(f"{name}.pos", pos)
    chance, n_contacts = np.random.default_rng(4), 0
    held = chance.integers(0, 5, 4)
    for k in range(1000):
        held = np.where(chance.random(4) < 0.2, chance.integers(0, 5, 4), held)
        if k % 3 == 0:  # the adversaries chase, so that there are contacts
            offset = [np.subtract(world.agents[3].state.p_pos, a.state.p_pos) for a in world.agents[:3]]
            held[:3] = [
                (1 if o[0] < 0 else 2) if abs(o[0]) > abs(o[1]) else (3 if o[1] < 0 else 4) for o in offset
            ]
        _, gained, *_ = peer.step(dict(zip(AGENTS, held.tolist(), strict=True)))
        obs, rewards, *_ = swarm.step(np.stack([held, held]))
        for a in range(4):  # the environment rounds to float32
            seen = inner.scenario.observation(world.agents[a], world)
            np.testing.assert_allclose(obs[1, a, : len(seen)], seen, rtol=0, atol=1e-9)
        np.testing.assert_allclose(rewards[1], [gained[name] for name in AGENTS], rtol=0, atol=1e-9)
        n_contacts += gained["adversary_0"] > 0
    assert n_contacts > 20
