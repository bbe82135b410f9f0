"""The tasks that come with tussle can be learned: who plays them by rule does better than who acts at random."""

import re
from typing import ClassVar

import gymnasium
import numpy as np
import pytest

from tussle import Block, Mission, rl
from tussle.errors import DeclarationError, ParameterError
from tussle.rl import Task, evaluate
from tussle.stock import Still

TASKS = ("Battle", "CaptureTheFlag", "Coverage", "FindWay", "Formation", "Hover", "Intercept", "ReachPoint")
N = 8


def at_random(task):
    chance, space = np.random.default_rng(1), task.action_space(0)
    shape = (N, len(task.agent_names), *space.shape)
    return lambda obs: chance.uniform(-1, 1, shape).astype(np.float32)


@pytest.mark.parametrize("name", TASKS)
@pytest.mark.slow
def test_rules_play_better_than_chance(name):
    task = getattr(rl, name)()
    by_rule, chance = evaluate(task, n_episodes=N), evaluate(task, at_random(task), N)
    gain = by_rule["return"] - chance["return"]
    assert gain.mean() > 2.0 * gain.std() / np.sqrt(N)


@pytest.mark.parametrize("name", TASKS)
def test_gymnasium_makes_it(name):
    with gymnasium.make(f"tussle/{name}-v0", disable_env_checker=True) as env:
        obs, _ = env.reset(seed=1)
        assert env.observation_space.shape == obs.shape
        assert np.isfinite(env.step(env.action_space.sample())[0]).all()


def test_an_episode_does_not_depend_on_the_others():
    alone = [evaluate(rl.Intercept, n_episodes=1, seed=seed) for seed in (1, 2, 3)]
    together = evaluate(rl.Intercept, n_episodes=3)
    assert sorted(together) == ["captures", "closing", "flag", "return"]
    for name, values in together.items():
        assert values.tolist() == [float(one[name][0]) for one in alone]


def test_a_flag_ends_the_episode_and_is_counted_once():
    idle = evaluate(rl.Intercept, lambda obs: np.zeros((2, 5, 2), np.float32), 2)
    assert idle["flag"].tolist() == [-5.0, -5.0]


def test_coverage_counts_what_linked_robots_see():
    swarm = rl.make_swarm(rl.Coverage(decide_every=1), 1)
    swarm.reset(seed=1)
    pos = np.full((1, 12, 3), 0.0)
    pos[0, :6, 0], pos[0, 6:, 0] = 50.0, -90.0
    swarm.simulation.write("robot.pos", pos)
    swarm.step(np.zeros((1, 12, 2), np.float32))
    offset = np.arange(-95.0, 100.0, 10.0)
    seen = ((offset[:, None] - 50.0) ** 2 + offset[None] ** 2 < 625.0).sum()
    assert swarm.terms["covered"][0, 0] == pytest.approx(0.01 * seen / 400.0)


@pytest.mark.parametrize(
    ("name", "value", "meant"),
    [
        ("reword", lambda self, now: 1.0, "reward"),
        ("rewards", {}, "reward"),
        ("lerners", "prey", "learners"),
        ("end", lambda self, now: False, "ends"),
        ("action_maks", lambda self, now: None, "action_mask"),
        ("time_limt", 3.0, "time_limit"),
    ],
)
def test_what_a_task_would_never_use_is_refused_with_what_was_meant(name, value, meant):
    with pytest.raises(
        DeclarationError, match=rf"Own.{name} is nothing that a task has.*did you mean '{meant}'"
    ):
        type("Own", (Task,), {name: value})
    type("Own", (Task,), {meant: value, "bonus": 3.0, "reward_of": None, "_rewards": ()})


def test_what_the_methods_of_a_task_use_may_have_any_name():
    class Own(Task):
        rewards: ClassVar = {"goal": 10.0}

        def reward(self, now):
            return self.rewards["goal"] * self.end(now)

        def end(self, now):
            return 1.0

    assert Own.rewards


@pytest.mark.parametrize(
    ("learners", "names"),
    [
        ("blue team", ["blue team"]),
        ("red", ["red"]),
        ("'blue team' red", ["blue team", "red"]),
        ('red "blue team"', ["blue team", "red"]),
        ("d'Or red", ["d'Or", "red"]),
        ("blue red",
         "there is no block 'blue' (did you mean 'blue team'?); there are: d'Or, blue team, red; a name with spaces is in quotes"),
        ("'blue team", "there is no block \"'blue\""),
        ("", "learners is empty"),
    ],
)  # fmt: skip
def test_blocks_whose_names_have_spaces_can_learn(learners, names):
    blocks = [Block(name=name, motion=Still()) for name in ("d'Or", "blue team", "red")]
    task = Task.__new__(Task)
    task.__dict__.update(_given={}, mission=Mission(blocks=blocks), learners=learners)
    if isinstance(names, str):
        with pytest.raises(ParameterError, match=re.escape(names)):
            _ = task.blocks
    else:
        assert [b.name for b in task.blocks] == names


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        (lambda: rl.PreyEscape(action=(rl.Act("speed turn_rate", 0.0, 1.0),)).decoders, "only levels set several channels"),
        *((lambda limit=limit: rl.PreyEscape(time_limit=limit), "a finite number of seconds > 0")
          for limit in (np.inf, np.nan, -1.0, 0.0)),
        *((lambda space=space, agent=agent: getattr(rl.PreyEscape(), space)(agent), "agent = ")
          for space in ("observation_space", "action_space") for agent in ("prey_3", -1, 100, 1.5)),
    ],
)  # fmt: skip
def test_values_that_mean_nothing_are_refused(wrong, told):
    with pytest.raises(ParameterError, match=re.escape(told)):
        wrong()
