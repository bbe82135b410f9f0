"""Agent-steps per CPU second through the interfaces that a learner calls: observations, rewards, and resets every 100 steps included.

    python benchmarks/learning.py [--seconds 3] [--json FILE]

One thread. Beside each figure: the same game without observations and rewards, stepped by the engine alone.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from tussle import Block, Mission, Simulation
from tussle.mission import read_mission
from tussle.rl import (
    Act,
    NearestOthers,
    Own,
    PredatorPrey,
    PredatorTeam,
    SimpleTag,
    Swarm,
    Task,
    Term,
    alive,
    died,
    make_swarm,
    make_vec,
    parallel_env,
)
from tussle.rl.flight import registered_task
from tussle.rl.teams import Fire
from tussle.stock import Learned, Unicycle

EPISODE = 100
SHIPPED = ("Battle", "Formation", "PreyEscape", "CaptureTheFlag")
"""Tasks that ship whose rewards or rules look at others."""


class Prey(PredatorPrey):
    """100 learned prey and ten scripted predators."""

    time_limit = 10.0


def army(name: str, team: int, east: float) -> Block:
    return Block(
        name=name, team=team, count=1000, position=(east, 0, 0), placement="uniform", half_width=(100, 200, 0),
        scatter_first=True, heading=f"{180 * (team - 1)} deg", motion=Unicycle(vel_max=10, turn_rate_max=2, use_pitch=False),
    )  # fmt: skip


class Battle(Task):
    """1,000 against 1,000, all learned."""

    mission = Mission(
        blocks=[army("red", 1, -120.0), army("blue", 2, 120.0)], dt=0.1, end=10.0, interactions=[Fire()]
    )
    learners = "red blue"
    observation = (
        Own("vel", scale=10.0, planar=True, frame="heading"),
        Own("health"),
        NearestOthers(
            8, radius=25.0, planar=True, columns="offset same_team present", scale={"offset": 25.0}
        ),
    )
    action = (Act("turn_rate", -2.0, 2.0), Act("speed", 0.0, 10.0))
    reward = {"alive": Term(alive, 0.01), "died": Term(died, -1.0)}  # noqa: RUF012


def timed(step: Callable[[], Any], seconds: float, n: int = EPISODE) -> float:
    """CPU seconds per call, after a warm-up of n calls."""
    for _ in range(n):
        step()
    calls, start = 0, time.process_time()
    while time.process_time() - start < seconds:
        for _ in range(n):
            step()
        calls += n
    return (time.process_time() - start) / calls


def actions_of(swarm: Swarm) -> np.ndarray:
    chance, shape = np.random.default_rng(1), (swarm.n_worlds, swarm.n_agents, swarm.action_width)
    if swarm.is_continuous:
        return chance.uniform(-1, 1, shape).astype(np.float32)
    return chance.integers(0, 5, shape)


def engine_alone(task: Any, n_worlds: int, seconds: float) -> float:
    """CPU seconds per step of the engine, with constant actions."""
    swarm = make_swarm(task, n_worlds, autoreset="disabled")
    swarm.reset(seed=1)
    swarm.step(actions_of(swarm))
    return timed(swarm.simulation.step, seconds)


def swarm_case(task: Any, n_worlds: int, seconds: float) -> dict[str, Any]:
    swarm = make_swarm(task, n_worlds)
    swarm.reset(seed=1)
    actions = actions_of(swarm)
    cpu, alone = timed(lambda: swarm.step(actions), seconds), engine_alone(task, n_worlds, seconds)
    n = swarm.n_worlds * swarm.n_agents
    width = swarm.obs.shape[-1]
    return {
        "agents": swarm.n_agents,
        "worlds": n_worlds,
        "floats": width,
        "M/s": n / cpu / 1e6,
        "engine M/s": n / alone / 1e6,
    }


def vector_case(task: Any, n_worlds: int, seconds: float) -> dict[str, Any]:
    env = make_vec(task, n_worlds)
    env.reset(seed=1)
    actions, n = actions_of(env.swarm), n_worlds * env.swarm.n_agents
    cpu = timed(lambda: env.step(actions), seconds)
    return {
        "agents": env.swarm.n_agents,
        "worlds": n_worlds,
        "floats": env.swarm.obs.shape[-1],
        "M/s": n / cpu / 1e6,
    }


def parallel_case(task: Any, seconds: float) -> dict[str, Any]:
    env = parallel_env(task)
    env.reset(seed=1)
    drawn = dict(zip(env.possible_agents, actions_of(env.swarm)[0], strict=True))
    n_agents: list[int] = []

    def step() -> None:
        n_agents.append(len(env.agents))
        env.step(drawn if len(env.agents) == len(drawn) else {a: drawn[a] for a in env.agents})
        if not env.agents:
            env.reset()

    cpu = timed(step, seconds)
    return {
        "agents": 100,
        "worlds": 1,
        "floats": env.swarm.obs.shape[-1],
        "M/s": np.mean(n_agents) / cpu / 1e6,
    }


def resets(seconds: float) -> float:
    """Speed with resets every 50 steps over that without."""
    often, never = (make_swarm(Prey(time_limit=limit), 64) for limit in (5.0, 1e6))
    cpu = []
    for swarm in (often, never):
        swarm.reset(seed=1)
        actions = actions_of(swarm)
        cpu.append(timed(lambda s=swarm, a=actions: s.step(a), seconds, 50))
    return cpu[1] / cpu[0]


def two_threads(seconds: float) -> float:
    """Wall time of one thread over that of two."""
    wall = []
    for threads in (1, 2):
        swarm = make_swarm(Prey, 64, threads=threads)
        swarm.reset(seed=1)
        actions = actions_of(swarm)
        begin, n = time.perf_counter(), 0
        while time.perf_counter() - begin < seconds:
            swarm.step(actions)
            n += 1
        wall.append(seconds / n)
    return wall[0] / wall[1]


def policies(seconds: float) -> dict[str, float]:
    """CPU time per step of 64 worlds of the paper's game with policies that ship, over that of the scripted game."""
    scripted, team = read_mission("predator_prey").mission, PredatorTeam().given
    learned = {
        "predator_team": (team, "switchers", Learned(policy="predator_team")),
        "prey_escape": (scripted, "prey", Learned(policy="prey_escape")),
    }
    cpu = {}
    for name, mission in [("", scripted), *((n, with_policy(*given)) for n, given in learned.items())]:
        with Simulation(mission, seeds=range(1, 65)) as simulation:
            cpu[name] = timed(simulation.step, seconds, 30)
    return {name: cpu[name] / cpu[""] for name in learned}


def with_policy(mission: Mission, owner: str, policy: Learned) -> Mission:
    return mission.replace(
        blocks=[
            b.replace(autonomy=(*(b.autonomy if b.name == "switchers" else ()), policy))
            if b.name == owner
            else b
            for b in mission.blocks
        ]
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=3.0)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    tag, s = SimpleTag(time_limit=10.0), options.seconds
    shipped = [registered_task(f"tussle/{name}-v0", "the benchmark") for name in SHIPPED]
    rows = {
        "prey, make_swarm": swarm_case(Prey, 64, s),
        "battle, make_swarm": swarm_case(Battle, 1, s),
        "tag, make_swarm": swarm_case(tag, 4096, s),
        **{
            f"{name}, shipped": swarm_case(task, round(7000 / len(task.agent_names)), s)
            for name, task in zip(SHIPPED, shipped, strict=True)
        },
        "prey, make_vec": vector_case(Prey, 64, s),
        "prey, PettingZoo": parallel_case(Prey, s),
        "Battle, PettingZoo": parallel_case(shipped[0].replace(time_limit=10.0), s),
    }
    print(f"{'':20} agents worlds floats  M agent-steps/CPU s  engine alone")
    for name, row in rows.items():
        alone = f"{row['engine M/s']:.2f}" if "engine M/s" in row else ""
        print(
            f"{name:20} {row['agents']:6} {row['worlds']:6} {row['floats']:6} {row['M/s']:20.2f} {alone:>13}"
        )
    ratio = resets(s)
    print(f"speed with resets every 50 steps over that without: {ratio:.2f}")
    threads = two_threads(s)
    print(f"speed with two threads over that with one, wall time: {threads:.2f}")
    shares = policies(s)
    for name, share in shares.items():
        print(f"game of 64 worlds with the policy {name} over the scripted game: {share:.2f}")
    if options.json:
        options.json.write_text(
            json.dumps({**rows, "resets": ratio, "threads": threads, "policies": shares}, indent=1)
        )


if __name__ == "__main__":
    main()
