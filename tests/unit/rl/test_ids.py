"""What holds for every task that is registered, and for a task of one's own."""

import gymnasium
import numpy as np
import pytest
from flee import Flee

from tussle.errors import ParameterError
from tussle.rl import (
    Computed,
    Each,
    FindWay,
    Means,
    NearestOthers,
    Own,
    PredatorTeam,
    Sectors,
    evaluate,
    make_swarm,
    make_vec,
)
from tussle.rl.environments import world_spaces
from tussle.rl.flight import registered_tasks

UNKNOWN = (
    *("tussle/Hover-v0", "tussle/ReachPoint-v0", "tussle/RLSimple-v0", "tussle/RLConsensus-v0"),
    *("tussle/SimpleTag-v0", "tussle/SimpleAdversary-v0"),
)
"""Tasks that observe only what has no bounds."""
IDS = sorted(name for name in registered_tasks() if name.startswith("tussle/"))


def short(name):
    """A task of a few decisions."""
    task = gymnasium.spec(name).kwargs["task"]()
    return task.replace(time_limit=6.0 * task.given.dt * task.decide_every)


def test_all_tasks_are_here():
    assert len(IDS) == 21


@pytest.mark.parametrize("name", IDS)
def test_rules_play_every_task(name):
    task = short(name)
    sums = evaluate(task, n_episodes=2)
    assert sums.keys() == {*task.reward, "return"}
    assert all(np.isfinite(value).all() for value in sums.values())
    moved = make_swarm(task.by_rule(), 1)
    moved.reset(seed=1)
    before = moved.simulation.read(f"{task.blocks[0].name}.pos")[0].copy()
    for _ in range(2):  # particles move by their old velocities
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
        with pytest.raises(
            ParameterError, match=rf"no autonomies play '{task.learners}' by rule.*give scripted ="
        ):
            evaluate(task, n_episodes=2)
    team = PredatorTeam(mission="predator_prey", time_limit=1.0)
    assert evaluate(team, n_episodes=1)["closing"][0] != 0.0


def test_overrides_are_not_ignored():
    with pytest.raises(
        ParameterError, match=r"overrides = \{'prey.count': 3\} is not allowed with a mission made in Python"
    ):
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
        np.testing.assert_array_equal(last["terms"][term], value.sum(axis=1))
        assert last["terms"][f"_{term}"].all()


class Watched(Flee):
    """All components, with scales of both signs."""

    observation = (
        Own("forward quat vel health", scale={"forward": -2.0, "vel": 5.0}, frame="body"),
        NearestOthers(
            3, "offset distance direction relative_vel quat same_team present", radius=40.0, scale=-3.0
        ),
        Sectors(5, 60.0),
        Means(50.0, "offset present", count_scale=2, frame="world"),
        Each("hunters", "offset direction present"),
        Computed(
            2, lambda simulation: np.cos(simulation.read("prey.pos")[0][..., :2]), low=[-1.0, -2.0], high=1.0
        ),
    )


def test_ranges_that_are_known_are_finite():
    space = Watched().observation_space(0)
    ends = [(float(a), float(b)) for a, b in zip(space.low.round(3), space.high.round(3), strict=True)]
    free, other = (-np.inf, np.inf), [(-13.333, 13.333)] * 3 + [(-13.333, 0.0)] + [(-0.333, 0.333)] * 3
    other += [free] * 3 + [(-0.333, 0.333)] * 4 + [(-0.333, 0.0)] * 2
    want = [(-0.5, 0.5)] * 3 + [(-1.0, 1.0)] * 4 + [free] * 4 + 3 * other + [(0.0, 1.0)] * 5
    want += [(0.0, np.inf)] + [(-50.0, 50.0)] * 3 + [(0.0, 1.0)]
    want += 2 * ([free] * 3 + [(-1.0, 1.0)] * 3 + [(0.0, 1.0)]) + [(-1.0, 1.0), (-2.0, 1.0)]
    np.testing.assert_allclose(np.array(ends), np.array(want), atol=2e-3)
    assert make_vec(Watched).single_observation_space.shape == (6, len(want))
    for wrong in ({"low": 1.0}, {"high": -1.0}, {"low": [-1.0, -1.0, -1.0]}):
        with pytest.raises(ParameterError, match="Computed: low"):
            make_swarm(Watched(observation=(Computed(2, np.cos, **wrong),)))


@pytest.mark.parametrize("name", [*IDS, "own"])
def test_observations_lie_in_their_space(name):
    task = Watched() if name == "own" else short(name)
    swarm = make_swarm(task, 3)
    swarm.reset(seed=1)
    chance = np.random.default_rng(1)
    low, high = task.limits
    space = world_spaces(task)[0]
    boxes = list(space.spaces.values()) if isinstance(space, gymnasium.spaces.Dict) else [space]
    assert sorted(np.concatenate([b.low.ravel() for b in boxes])) == sorted(low.ravel())
    assert np.isfinite(low).any() or name in UNKNOWN
    assert ((low <= 0) & (high >= 0)).all()
    for _ in range(20):
        shape = 3, swarm.n_agents, swarm.action_width
        actions = chance.choice([-1.0, 1.0], shape).astype(task.dtype)
        swarm.step(actions if swarm.is_continuous else (actions > 0).astype(int))
        assert ((swarm.obs >= low) & (swarm.obs <= high)).all()
