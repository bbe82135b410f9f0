"""Learners' games are watched in a browser with render_mode="human"."""

import threading
import urllib.request
import warnings

import numpy as np
import pytest
from pettingzoo.utils import parallel_to_aec

from tussle.errors import ParameterError
from tussle.rl import make, make_vec, parallel_env


@pytest.fixture
def env(task):
    pytest.importorskip("aiohttp")
    env = make(task, render_mode="human")
    env.reset(seed=1)
    env._pictures._page.game.warp = None
    yield env
    env.close()


def played(env, n):
    """Play decisions in a new thread, as a learner whose game is steered from a browser."""
    thread = threading.Thread(target=lambda: [env.step(env.action_space.sample()) for _ in range(n)])
    thread.start()
    return thread


def test_the_page_shows_the_state_of_the_last_decision(env):
    page = env._pictures._page
    assert env.render() is None
    with urllib.request.urlopen(page.url) as answer:
        assert b"<title>" in answer.read()
    live = page.game
    live.frame()
    for step in (1, 2, 3):
        env.step(env.action_space.sample())
        assert live.step_number == step
    while live.frame().step < 3:  # frames are made at a limited rate
        live._playback.follow()
    assert np.array_equal(live.frame().pos[:6], env.swarm.simulation.read("prey.pos")[0][0])


def test_a_paused_game_makes_the_steps_that_are_ordered(env):
    live = env._pictures._page.game
    live.pause()
    learner = played(env, 5)
    for n in (1, 2):
        live.step()
        while live.step_number < n or env.swarm.lengths[0] < n:
            assert learner.is_alive()
    assert learner.is_alive()
    live.resume()
    learner.join()
    assert live.step_number == 5


def test_a_closed_page_holds_nothing_up(env):
    live = env._pictures._page.game
    live.pause()
    learner = played(env, 1)
    live.stop()
    learner.join()
    assert env.swarm.lengths[0] == 1


def test_the_learner_alone_resets_and_rewinds(env):
    live = env._pictures._page.game
    for order in (live.reset, live.step_back, lambda: live.seek(0.0), lambda: live.publish_key("a")):
        with pytest.raises(ParameterError, match="another program plays this game"):
            order()
    for _ in range(3):
        env.step(env.action_space.sample())
    epoch = live.epoch
    env.reset(seed=2)
    assert (live.epoch, live.step_number, live.seed) == (epoch + 1, 0, 2)
    assert [event.kind for event in live.events] == ["birth"] * 8


def test_episodes_that_begin_by_themselves_are_followed(task):
    pytest.importorskip("aiohttp")
    envs = make_vec(task.replace(time_limit=0.4), 2, autoreset="same_step", render_mode="human")
    envs.reset(seed=1)
    live = envs._pictures._page.game
    live.warp = None
    steps = []
    for _ in range(9):
        envs.step(envs.action_space.sample())
        steps.append(live.step_number)
    envs.close()
    assert steps == [1, 2, 3, 0, 1, 2, 3, 0, 1]
    assert live.epoch == 2


@pytest.mark.needs("renderer")
def test_pettingzoo_accepts_all_modes(task):
    pytest.importorskip("pyvista")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of PettingZoo itself
        from pettingzoo.test import render_test

        render_test(lambda render_mode: parallel_to_aec(parallel_env(task, render_mode=render_mode)))
