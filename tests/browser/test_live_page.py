"""A live game in a real browser: what is pressed there happens in the game, and what happens there is seen."""

import signal
from itertools import pairwise

import numpy as np
import pytest
from recorded_games import hunt
from served import UNHURRIED, Watched, another_browser, family_of, send_all
from watched_plugins import clickable

from tussle import Recorder, Simulation
from tussle.record import load_inputs
from tussle.view import Live
from tussle.view.page.server import Page


@pytest.fixture(scope="module")
def game(chromium):
    """A page on a game that stands still, and a browser that shows it."""
    with (
        Simulation(hunt(n_prey=6, end=120.0, end_conditions="time"), 3) as simulation,
        Live(simulation, is_paused=True, pace=1.0) as live,
        Page(live, viewer=UNHURRIED) as page,
    ):
        watched = Watched(chromium, page)
        yield live, page, watched
        watched.close()
        assert not watched.trouble, "\n".join(watched.trouble)


@pytest.fixture(autouse=True)
def standing_still(game):
    live, _, _ = game
    yield
    live.pause()
    live.warp = 1.0
    live.settle()


def at(live, step):
    return lambda: live.step_number == step and live.settle()


def test_the_page_shows_the_beginning(game):
    live, _, watched = game
    live.seek(0.0)
    live.settle()
    assert watched.tab.locator("#head h1").inner_text() == "hunt"
    watched.wait("player.t === 0 && player.frame === 0")
    assert sorted(watched.tab.evaluate("() => player.ids")) == live.frame().id.tolist()
    assert watched.tab.locator("#teams .team").count() == 2


def test_buttons_step_play_and_pause(game):
    live, _, watched = game
    live.seek(0.0)
    live.settle()
    watched.button("A step on")
    watched.until(at(live, 1))
    watched.wait("player.frame === 1")
    watched.button("A step back")
    watched.until(at(live, 0))
    watched.wait("player.frame === 0")
    watched.button("Play")
    watched.until(lambda: live.step_number > 2)
    watched.button("Pause")
    watched.until(lambda: live.is_paused and live.settle())
    there = live.step_number
    watched.wait(f"player.frame === {there} && !player.isPlaying")
    watched.tab.wait_for_timeout(400)
    assert live.step_number == there


def test_news_of_the_panels_do_not_draw_a_game_anew_that_stands_still(game):
    live, _, watched = game
    n_drawn = []
    # The last states of a game may arrive after a picture of it, so that single pictures more are right.
    for warp in (2.0, 3.0, 4.0, 5.0, 6.0, 7.0):
        live.warp = warp
        watched.wait(f"player.status.warp === {warp:g} && player.isDrawn")
        assert watched.tab.locator("#speed").inner_text() == f"{warp:g}×"
        n_drawn.append(watched.tab.evaluate("() => player.nDrawn"))
    assert any(before == after for before, after in pairwise(n_drawn)), n_drawn


def test_frames_are_those_that_the_browser_draws_and_states_those_that_are_sent(game):
    live, _, watched = game
    live.seek(0.0)
    live.settle()
    # At most two pictures a second, whatever comes from the server.
    watched.tab.evaluate("() => { window.drawAtOnce = window.requestAnimationFrame; "
                         "window.requestAnimationFrame = (draw) => setTimeout(() => draw(performance.now()), 500); }")  # fmt: skip
    watched.button("Play")
    try:
        watched.wait(
            """(() => {
                const text = document.querySelector('#subtitle').innerText;
                const [, frames, states] = /([\\d.]+) frames\\/s · (\\d+) states\\/s sent/.exec(text) ?? [];
                return Number(frames) > 0 && Number(frames) <= 2.25 && Number(states) > 4;
            })()"""
        )
    finally:
        watched.tab.evaluate("() => { window.requestAnimationFrame = window.drawAtOnce; }")


def test_keys_of_a_real_keyboard(game):
    live, _, watched = game
    live.seek(0.0)
    live.settle()
    for key, holds in (
        (".", at(live, 1)), (",", at(live, 0)), ("Backspace", at(live, 0)), ("b", lambda: not live.is_paused),
        ("Space", lambda: live.is_paused), ("]", lambda: live.warp == 2.0), ("[", lambda: live.warp == 1.0),
        ("m", lambda: live.warp == np.inf), ("m", lambda: live.warp == 1.0), (";", lambda: len(live.injections) == 1),
    ):  # fmt: skip
        watched.press(key)
        watched.until(holds)
        watched.wait(f"player.status.isPaused === {str(live.is_paused).lower()} && (player.status.warp ?? 0) === "
                     f"{0 if live.warp == np.inf else live.warp}")  # fmt: skip


def test_keys_and_marks_that_jump_to_events(game):
    live, _, watched = game
    live.step(60)
    live.settle()
    watched.wait("player.events.length > 2 && player.frame >= 60")
    live.seek(0.0)
    live.settle()
    watched.wait("player.t === 0")
    times = sorted({h.t for h in live.events if h.t > 0.0})
    for key, t in (("PageDown", times[0]), ("PageDown", times[1]), ("PageUp", times[0])):
        watched.press(key)
        watched.until(lambda t=t: live.t == pytest.approx(t))
        watched.wait(f"Math.abs(player.t - {t}) < 1e-6")
    box = watched.tab.locator("#events").bounding_box()
    marks = watched.tab.evaluate("() => player.events")
    share = marks[-1]["t"] / watched.tab.locator("#time").evaluate("(s) => Number(s.max)")
    watched.tab.mouse.click(box["x"] + 7.5 + share * (box["width"] - 15), box["y"] + 12)
    watched.until(lambda: live.t > times[1])


def test_the_slider_goes_back_and_the_future_is_the_same(game):
    live, _, watched = game
    live.seek(0.0)
    live.step(30)
    live.settle()
    future = live.simulation.state_hash()
    watched.wait("player.frame === 30")
    watched.tab.locator("#time").evaluate("(s) => { s.value = '1.2'; s.dispatchEvent(new Event('input')); }")
    watched.until(at(live, 12))
    live.step(18)
    watched.until(at(live, 30))
    assert live.simulation.state_hash() == future


def test_a_click_on_an_entity_chooses_it_and_the_camera_follows_it(game):
    live, page, watched = game
    watched.press("o")
    watched.wait("player.mode === 'overview' && player.isDrawn")
    who = int(live.frame().id[-1])
    watched.tab.mouse.click(*watched.wait(f"player.pixelOf({who})"))
    watched.wait("player.chosen > 0")
    who = watched.tab.evaluate("() => player.chosen")
    watched.until(lambda: page.publisher.readers[0].chosen == who)
    watched.wait(f"player.status.entity && player.status.entity.id === {who}")
    watched.wait("document.querySelectorAll('#sections h3').length > 0")
    watched.press("a")
    watched.wait("player.mode === 'follow'")
    live.step(10)
    live.settle()
    frame = live.frame()
    east, north, _ = frame.pos[frame.row_of(who)]
    watched.wait(f"Math.hypot(player.camera.target[0] - {east}, player.camera.target[1] - {north}) < 0.5")
    watched.press("Escape")
    watched.wait("player.chosen === 0")


def test_trails_lead_back_after_a_jump(game):
    live, _, watched = game
    live.step(80)
    live.settle()
    live.seek(6.0)
    live.settle()
    watched.wait("Math.abs(player.t - 6) < 1e-6 && player.trailPoints > 100")


def test_two_browsers_watch_on_their_own_and_steer_together(chromium, game):
    live, page, watched = game
    other = Watched(chromium, page, {"width": 500, "height": 360})
    try:
        other.press("ArrowRight")
        other.wait("player.chosen > 0")
        assert watched.tab.evaluate("() => player.chosen") == 0
        there = live.step_number
        other.button("A step on")
        other.until(at(live, there + 1))
        for one in (watched, other):
            one.wait(f"player.frame === {there + 1}")
        assert not other.trouble
    finally:
        other.close()
    watched.until(lambda: page.n_readers == 1)


def test_a_point_is_picked_and_shapes_of_plugins_are_seen(chromium):
    with (
        Simulation(clickable(), 1) as simulation,
        Live(simulation, is_paused=True) as live,
        Page(live, viewer=UNHURRIED) as page,
    ):
        watched = Watched(chromium, page)
        watched.press("p")
        watched.tab.mouse.click(400, 300)
        watched.until(lambda: len(live.injections) == 1)
        assert live.injections[0].fields["pos"][2] == pytest.approx(0.0, abs=1e-6)
        watched.tab.mouse.click(400, 300)
        watched.until(lambda: live._collector.is_open)
        live.step()
        watched.wait("player.shapes.some(([kind, n]) => kind === 'arrows' && n === 3)")
        assert len(live.injections) == 1, "a second click is no second point"
        watched.close()
        assert not watched.trouble


def test_what_people_do_is_recorded_and_comes_again(chromium, tmp_path):
    with (
        Simulation(clickable(), 1) as simulation,
        Recorder(simulation, tmp_path / "run"),
        Live(simulation, is_paused=True) as live,
        Page(live, viewer=UNHURRIED) as page,
    ):
        watched = Watched(chromium, page)
        for n, (x, y) in enumerate(((400, 300), (420, 330), (380, 320)), 1):
            watched.press("p")
            watched.tab.mouse.click(x, y)
            watched.until(lambda n=n: len(live.injections) == n)
            live.step(7)
            live.settle()
        watched.press(";")
        watched.until(lambda: len(live.injections) == 4)
        watched.close()
        live.step(100)
        live.settle()
        wanted = simulation.state_hash()
    inputs = load_inputs(tmp_path / "run")
    assert [(each.step, each.name) for each in inputs] == [
        *((step, "WorldPointClicked") for step in (0, 7, 14)), (21, "CustomKeyPress"),
    ]  # fmt: skip
    for _ in range(3):
        with Simulation(clickable(), 1) as simulation:
            simulation.play_inputs(inputs)
            simulation.run()
            assert simulation.state_hash() == wanted


def test_a_browser_that_hangs_holds_up_neither_game_nor_page(chromium, game):
    live, page, watched = game
    flag = "--tussle-hangs"
    browser = another_browser(chromium, flag)
    hanging = Watched(browser, page)
    family = family_of(flag)
    assert len(family) > 1
    live.seek(0.0)
    live.step(100)
    live.settle()
    calm = live.simulation.state_hash()
    try:
        send_all(family, signal.SIGSTOP)
        live.seek(0.0)
        live.settle()
        live.warp = 5.0
        live.resume()
        made = page.publisher.n_made
        watched.until(lambda: live.step_number >= 100)
        live.pause()
        live.seek(10.0)
        live.settle()
        assert live.simulation.state_hash() == calm
        assert page.publisher.n_made > made + 1
        watched.wait("Math.abs(player.t - 10) < 1e-6")
    finally:
        send_all(family, signal.SIGCONT)
        live.warp = 1.0
    hanging.close()
    browser.close()
