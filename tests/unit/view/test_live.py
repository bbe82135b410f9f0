"""A game that is watched is the game that would have been played, whoever looks and whatever is pressed."""

import threading
import time

import numpy as np
import pytest
from golden_runs import kept, simulation
from missions import STEPS
from recorded_games import hunt
from watched_plugins import FailsOnce, KillsAndMoves, clickable, failing

from tussle import Simulation
from tussle.errors import ParameterError, PluginError
from tussle.messages import CustomKeyPress, WorldPointClicked
from tussle.view import Live, frame_of


def wait_for(condition, timeout=300.0):
    """Wait until it holds."""
    until = time.monotonic() + timeout
    while not condition():
        assert time.monotonic() < until, "it does not come"
        time.sleep(0.002)


def watch_everything(live, stop):
    """What a page does, as fast as it can."""
    while not stop.is_set():
        frame = live.frame()
        live.result(), live.shapes(), live.events, live.notes, live.warp_reached, live.span
        if len(frame):
            live.entity(int(frame.id[0]))
        live.frame_at(frame.t - 1.0)


# -- the same result --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["chase_sequential", "births_and_radio", "slow_clocks", "cars"])
def test_the_golden_hashes_with_all_controls_used_and_a_viewer_that_never_sleeps(name):
    stop = threading.Event()
    with simulation(name, 1) as sim, Live(sim, pace=None, is_paused=True, snapshot_every=0.3) as live:
        viewer = threading.Thread(target=watch_everything, args=(live, stop))
        viewer.start()
        live.step(3)
        live.resume()
        live.pause()
        live.step(1)
        live.step_back(2)
        live.seek(0.5)
        live.warp = 3.0
        live.resume()
        live.faster()
        live.warp = None
        live.seek(0.2)
        live.toggle()
        live.seek(sim.mission.start + STEPS[name] * sim.mission.dt)
        assert live.settle()
        wait_for(lambda: not live._playback.is_seeking and live.step_number == STEPS[name])
        stop.set()
        viewer.join()
        assert live.error is None
        assert sim.state_hash() == kept(name, 1)


def test_a_viewer_that_stalls_delays_nothing_and_changes_nothing():
    game = hunt()
    alone = Simulation(game)
    alone.run()
    with Live(Simulation(game), pace=None, is_paused=True) as live:
        asleep = live.frame()
        live.resume()
        wait_for(lambda: live.is_over)
        assert asleep.t == 0.0
        assert live.simulation.state_hash() == alone.state_hash()
        assert live.result() is None or live.result().end == "time"
        wait_for(lambda: live.frame().t == 6.0)


def test_nothing_is_made_while_nobody_asks():
    with Live(Simulation(clickable(end=100.0)), pace=None) as live:
        wait_for(lambda: live.step_number > 200)
        assert live._frame.n_made == 1  # the first
        assert live._result.n_made == live._shapes.n_made == 0
        assert live.simulation.state.context.draw.sinks == []
        live.frame()
        wait_for(lambda: live._frame.n_made >= 2)


def test_frames_are_made_thirty_times_a_second_at_most():
    with Live(Simulation(clickable(end=1e4)), pace=None) as live:
        began = time.monotonic()
        wait_for(
            lambda: live.frame() is not None and live._frame.n_made >= 5 and time.monotonic() > began + 0.5
        )
        assert live._frame.n_made <= 30 * (time.monotonic() - began) + 2


# -- controls -----------------------------------------------------------------------------------------------------------------------


@pytest.fixture
def live():
    with Live(Simulation(clickable()), is_paused=True) as live:
        yield live


def test_a_paused_game_stands_still_and_steps_exactly(live):
    assert (live.step_number, live.t, live.is_paused, live.is_over) == (0, 0.0, True, False)
    for n in (1, 1, 3):
        before = live.step_number
        live.step(n)
        assert live.settle()
        assert live.step_number == live.frame().step == before + n
    assert live.t == pytest.approx(0.5)
    assert live.frame().t == live.t
    time.sleep(0.15)
    assert live.step_number == 5


def test_steps_and_steps_back_are_counted_one_after_the_other(live):
    for n in (4, 1, 1, 6):
        live.step(n)
    live.step_back(2)
    live.step_back()
    live.step(2)
    assert live.settle()
    assert live.step_number == 12 - 3 + 2
    live.step_back(100)
    assert live.settle()
    assert live.step_number == 0


def test_pausing_and_going_on(live):
    live.resume()
    wait_for(lambda: live.step_number > 2)
    live.toggle()
    assert live.is_paused
    assert live.settle()
    at = live.step_number
    time.sleep(0.25)
    assert live.step_number == at
    assert live.warp_reached == live.steps_per_second == 0.0
    live.toggle()
    wait_for(lambda: live.step_number > at)


def test_a_step_of_a_game_that_goes_on_pauses_it(live):
    live.warp = 2.0
    live.resume()
    wait_for(lambda: live.step_number > 1)
    live.step()
    assert live.settle()
    assert live.is_paused
    at = live.step_number
    time.sleep(0.15)
    assert live.step_number == at


def test_time_goes_as_fast_as_is_wanted():
    with Live(Simulation(clickable(end=1e4)), pace=4.0) as live:
        wait_for(lambda: live.step_number > 0)
        began, t = time.monotonic(), live.t
        time.sleep(1.5)
        assert live.t - t <= 4.0 * (time.monotonic() - began) + 1.5
        # As soon as the machine has no other things to do
        wait_for(lambda: live.warp_reached == pytest.approx(4.0, rel=0.3))
        wait_for(lambda: live.steps_per_second == pytest.approx(40.0, rel=0.3))
        live.warp = None
        wait_for(lambda: live.warp_reached > 20.0)
        assert live.warp == float("inf")


def test_a_game_that_is_all_but_stopped_still_hears():
    with Live(Simulation(clickable()), pace=1e-320) as live:
        wait_for(lambda: live._playback._wait is not None)
        live.step(3)
        wait_for(lambda: live.step_number >= 3)


def test_warp_goes_up_and_down_as_in_the_existing_viewer(live):
    seen = [live.warp]
    for change in [live.faster] * 4 + [live.slower] * 6:
        change()
        seen.append(live.warp)
    assert seen == [1.0, 2.0, 3.0, 4.0, 5.0, 4.0, 3.0, 2.0, 1.0, 0.5, 0.25]
    live.warp = None
    live.faster()
    assert live.warp == float("inf")
    live.slower()
    assert live.warp == 1.0  # it stands still


def test_seeking_goes_to_the_last_step_not_after_a_time(live):
    for t, step in (
        (3.0, 30),
        (1.05, 10),
        (0.3, 3),
        (0.0, 0),
        (-5.0, 0),
        (0.30000000000000004, 3),
        (100.0, 80),
    ):
        live.seek(t)
        assert live.settle()
        wait_for(lambda: not live.is_seeking)
        wait_for(lambda step=step: live.step_number == step)
        assert live.is_paused
    assert live.is_over
    assert live.span == (0.0, 8.0)


def test_of_many_seeks_the_last_counts(live):
    live.seek(7.0)
    for t in np.linspace(0.0, 7.9, 200):
        live.seek(t)
    live.seek(2.0)
    wait_for(lambda: live.step_number == 20)
    assert live.settle()
    assert live.step_number == 20


def test_going_on_after_a_seek(live):
    live.warp = None
    live.seek(3.0)
    live.resume()
    wait_for(lambda: live.is_over)
    assert not live.is_paused
    live.seek(1.0)
    wait_for(lambda: live.is_over and live.step_number == 80)


def test_beginning_anew_with_the_same_and_with_another_seed(live):
    live.step(5)
    live.settle()
    first = live.simulation.state_hash()
    epoch = live.epoch
    live.reset()
    live.step(5)
    live.settle()
    assert live.simulation.state_hash() == first
    assert live.epoch == epoch + 1
    live.reset(seed=77)
    live.step(5)
    live.settle()
    assert live.seed == 77
    alone = Simulation(clickable(), seeds=77)
    alone.step(5)
    assert live.simulation.state_hash() == alone.state_hash() != first
    live.resume()
    live.warp = None
    wait_for(lambda: live.is_over)
    live.pause()
    live.reset()
    live.settle()
    assert not live.is_over
    assert live.span == (0.0, 0.0)
    assert [(h.t, h.kind, h.id) for h in live.events] == [(0.0, "birth", i) for i in (1, 2, 3)]


def test_controls_return_at_once_while_a_step_takes_long():
    with Live(Simulation(clickable(end=1e6)), pace=None) as live:
        live.seek(5e5)  # takes minutes
        for control in (
            live.pause,
            live.resume,
            live.toggle,
            live.step,
            live.step_back,
            live.faster,
            live.slower,
        ):
            control()
        live.publish_click((1, 2, 3))
        assert live.step_number < 5e6
        live.seek(1.0)
        live.frame(), live.result(), live.entity(1), live.shapes()
        assert live.settle()


def test_values_that_are_not_allowed(live):
    sim = Simulation(clickable())
    for settings, text in (
        ({"world": 1}, r"world = 1 is not allowed; there are worlds 0 to 0"),
        ({"world": 0.5}, r"world = 0.5 is not allowed; there are worlds 0 to 0"),
        ({"world": "a"}, r"world = 'a' is not allowed; there are worlds 0 to 0"),
        ({"pace": 0.0}, "warp = 0.0 is not allowed"),
        ({"pace": "fast"}, "warp = 'fast' is not allowed"),
        ({"snapshot_every": 0.0}, "snapshot_every = 0.0 is not allowed"),
        ({"memory": float("nan")}, "memory = nan is not allowed"),
    ):
        with pytest.raises(ParameterError, match=text):
            Live(sim, **settings)
    for call, text in (
        (lambda: setattr(live, "warp", -1.0), "warp = -1.0"),
        (lambda: setattr(live, "warp", True), "warp = True"),
        (lambda: live.seek(float("nan")), "t = nan"),
        (lambda: live.frame_at(float("inf")), "t = inf"),
        (lambda: live.reset(seed=1.5), "seed = 1.5"),
        (lambda: live.publish_click((1, 2)), r"point = \(1, 2\)"),
        (lambda: live.publish_click((1, 2, float("nan"))), "takes x, y, z"),
    ):
        with pytest.raises(ParameterError, match=text):
            call()


def test_stopping_leaves_the_game_to_its_owner():
    game = hunt()
    sim, alone = Simulation(game), Simulation(game)
    calls = len(sim.schedule)
    live = Live(sim, pace=None, is_paused=True)
    live.step(10)
    live.shapes()
    live.settle()
    live.stop()
    live.stop()
    assert not live._thread.is_alive()
    assert len(sim.schedule) == calls
    assert not sim.events
    assert sim.state.context.draw.sinks == []
    sim.run()
    alone.run()
    assert sim.state_hash() == alone.state_hash()


# -- without a thread -----------------------------------------------------------------------------------------------------------------


def test_without_a_thread_each_control_is_carried_out_at_once():
    game = hunt()
    alone = Simulation(game)
    live = Live(Simulation(game), threaded=False)
    live.resume()
    assert live.step_number == 0
    for n in (1, 5, 20):
        live.step(n)
        alone.step(n)
        assert live.simulation.state_hash() == alone.state_hash()
        assert live.frame().step == live.step_number == alone.steps[0]
        np.testing.assert_array_equal(live.frame().pos, frame_of(alone).pos)
        assert live.result().alive == alone.result()[0].alive
        assert live.entity(int(live.frame().id[0])).t == live.t
    live.seek(0.5)
    assert live.step_number == 5
    assert live.settle()


# -- what is seen -----------------------------------------------------------------------------------------------------------------------


def test_a_look_back_while_the_game_goes_on():
    game = hunt()
    alone = Simulation(game)
    live = Live(Simulation(game), threaded=False)
    frames = []
    for _ in range(60):
        frames.append(frame_of(alone))
        alone.step()
        live.step()
    kept_steps = live._player.history.steps
    assert kept_steps[0] == 0
    assert len(kept_steps) > 20
    for t in (-1.0, 0.0, 2.31, 5.9, 6.0):
        seen = live.frame_at(t)
        step = max(s for s in kept_steps if s <= max(0.0, t * 10 + 1e-6))
        assert seen.step == step
        if step < 60:
            np.testing.assert_array_equal(seen.id, frames[step].id)
            np.testing.assert_array_equal(seen.team, frames[step].team)
            for name in ("pos", "quat", "vel", "health"):
                values = getattr(frames[step], name)
                np.testing.assert_allclose(getattr(seen, name), values, rtol=1e-6, atol=1e-4)
    assert live.step_number == 60


def test_happenings_and_the_result_so_far():
    game = hunt()
    live = Live(Simulation(game), threaded=False)
    live.step(60)
    told = live.events
    births, deaths = ([h for h in told if h.kind == kind] for kind in ("birth", "death"))
    assert [h.text for h in births] == ["prey"] * 12 + ["hunters"] * 3 + ["late"] * 3
    assert sum(live.result().alive.values()) == 15 + 3 - len(deaths)
    assert told[-1].kind == "end"
    live.seek(1.0)
    assert live.events == told
    assert live.result().t == pytest.approx(1.0)
    assert live.result().state_hash == ""
    live.step(50)
    assert live.events == told
    assert live.result().end == "time"
    assert live.result().state_hash == live.simulation.state_hash()


def test_one_world_of_a_stack_is_watched_until_it_ends():
    game = hunt(n_prey=3, end=30.0)
    sim, alone = Simulation(game, seeds=[1, 3]), Simulation(game, seeds=3)
    alone.run()
    with Live(sim, world=1, pace=None) as live:
        wait_for(lambda: live.is_over)
        assert live.step_number == alone.steps[0]
        assert sim.state_hash(1) == alone.state_hash()
        assert live.events[-1].kind == "end"
        live.pause()
        live.seek(2.0)
        wait_for(lambda: not live.is_seeking and live.step_number == 20)
        assert not live.is_over
        live.reset(seed=1)
        live.settle()
        assert live.seed == 1
        assert sim.steps[0] > sim.steps[1] == 0


def test_what_stands_still_and_how_it_looks():
    viewer = {"entities": {"prey": {"color": "1 2 3", "visual_model": "car"}}, "grid_spacing": 11.0}
    live = Live(Simulation(hunt()), threaded=False, viewer=viewer)
    assert live.name == "hunt"
    assert live.blocks == ["prey", "late", "hunters"]
    assert live.block_teams == [1, 1, 2]
    assert live.teams == {1: "prey, late", 2: "hunters"}
    assert live.style.block_colour(0) == (1, 2, 3)
    assert [live.style.model(b) for b in range(3)] == ["car", "aircraft", "aircraft"]
    assert live.scenery.grid_step == 11.0


# -- errors -----------------------------------------------------------------------------------------------------------------------------


def test_a_plugin_that_fails_stops_the_game_and_it_can_be_wound_back_to_before():
    with Live(Simulation(failing()), pace=None) as live:
        wait_for(lambda: live.error is not None)
        assert isinstance(live.error, PluginError)
        assert "it is late" in str(live.error)
        assert live.is_over
        assert live.is_paused
        assert live.settle()
        live.resume()
        live.step(3)
        assert live.settle()
        assert live.step_number == 10
        live.step_back(4)
        assert live.settle()
        assert live.error is None
        assert not live.is_over
        assert live.step_number == 6
        reference = Simulation(failing())
        reference.step(6)
        assert live.simulation.state_hash() == reference.state_hash()
        live.step(10)
        live.settle()
        wait_for(lambda: "it is late" in str(live.error))
        live.reset(3)
        assert live.settle()
        assert live.error is None
        assert live.step_number == 0


def test_a_step_that_was_broken_off_leaves_nothing_behind():
    game = clickable(interactions=[KillsAndMoves(), FailsOnce()])
    live = Live(Simulation(game), threaded=False)
    live.step(10)
    assert "nobody spoke" in str(live.error)
    assert live.step_number == 5
    live.step_back(2)
    live.step(2)
    assert live.error is None
    reference = Simulation(game)
    reference.step(5)
    assert live.simulation.state_hash() == reference.state_hash()
    live.publish_key("k")
    reference.publish(CustomKeyPress, key="k")
    live.step(3)
    reference.step(3)
    assert live.simulation.state_hash() == reference.state_hash()
    assert len(live.frame()) == 2


def test_a_failure_that_only_ends_the_world_is_told_too():
    with Live(Simulation(failing(), on_error="record"), pace=None) as live:
        wait_for(lambda: live.is_over)
        assert "it is late" in str(live.error)
        live.seek(0.5)
        live.settle()
        wait_for(lambda: live.step_number == 5 or live.is_over)


def test_what_cannot_be_said_is_noted(live):
    live.publish(WorldPointClicked, network="GlobalNetwerk", pos=(1, 2, 3))
    live.publish(WorldPointClicked, position=(1, 2, 3))
    live.step()
    assert live.settle()
    assert [("GlobalNetwork" in n, "position" in n) for n in live.notes] == [(True, False), (False, True)]
    assert live.error is None
    assert live.injections == []
    assert live.step_number == 1
