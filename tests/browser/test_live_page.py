"""A live game in a real browser: what is pressed there happens in the game, and what happens there is seen."""

import signal

import numpy as np
import pytest
from recorded_games import hunt
from served import SMALL, UNHURRIED, Watched, another_browser, family_of, send_all

from tussle import Simulation
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
    live.settle()


def at(live, step):
    return lambda: live.step_number == step and live.settle()


def test_the_page_shows_the_beginning(game):
    _, _, watched = game
    watched.wait(lambda: watched.reads("tussle · hunt"))
    watched.wait(lambda: watched.reads("t = 0.00 s"))
    for text in ("prey", "hunters", "Camera", "Entity", "Show"):
        assert watched.reads(text)
    assert watched.tab.get_by_role("button", name="Share").count() == 0


def test_step_moves_the_clock_by_one_dt_and_back_again(game):
    live, _, watched = game
    watched.button("Step")
    watched.wait(at(live, 1))
    watched.wait(lambda: watched.reads("t = 0.10 s"))
    watched.button("Back")
    watched.wait(at(live, 0))
    watched.wait(lambda: watched.reads("t = 0.00 s"))


def test_pause_stops_the_clock(game):
    live, _, watched = game
    watched.button("Play")
    watched.wait(lambda: live.step_number > 2)
    watched.button("Pause")
    watched.wait(lambda: live.is_paused and live.settle())
    there = live.step_number
    watched.tab.wait_for_timeout(400)
    assert live.step_number == there
    watched.wait(lambda: watched.reads(f"t = {live.t:.2f} s"))


def test_keys_of_a_real_keyboard(game):
    live, page, watched = game
    display, visitor = page.display, watched.visitor
    live.seek(0.0)
    live.settle()
    for key, holds in (
        ("Space", at(live, 1)), ("Backspace", at(live, 0)), ("b", lambda: not live.is_paused), ("b", lambda: live.is_paused),
        ("]", lambda: live.warp == 2.0), ("[", lambda: live.warp == 1.0), ("m", lambda: live.warp == np.inf),
        ("m", lambda: live.warp == 1.0), ("-", lambda: display.model_scale < 0.9), ("0", lambda: display.model_scale == 1.0),
        ("Shift++", lambda: display.model_scale > 1.2), ("=", lambda: display.model_scale > 1.5),
        ("0", lambda: display.model_scale == 1.0), ("w", lambda: display.is_wireframe), ("s", lambda: not display.is_wireframe),
        ("t", lambda: display.has_trails), ("g", lambda: display.has_links), ("g", lambda: not display.has_links),
        ("ArrowRight", lambda: visitor.chosen == 1), ("ArrowRight", lambda: visitor.chosen == 2),
        ("ArrowLeft", lambda: visitor.chosen == 1), ("Shift+N", lambda: display.label_scale < 1.0),
        ("n", lambda: display.label_scale == 1.0), (";", lambda: len(live.injections) == 1),
    ):  # fmt: skip
        watched.press(key)
        watched.wait(holds, 40.0)


def test_keys_that_jump_to_events(game):
    live, _, watched = game
    live.step(60)
    live.settle()
    live.seek(0.0)
    live.settle()
    times = sorted({h.t for h in live.happenings if h.t > 0.0})
    for key, t in ((".", times[0]), (".", times[1]), (",", times[0])):
        watched.press(key)
        watched.wait(lambda t=t: live.t == pytest.approx(t))


def test_the_slider_goes_back_and_the_future_is_the_same(game):
    live, _, watched = game
    live.seek(0.0)
    live.step(30)
    live.settle()
    future = live.simulation.state_hash()
    time_field = watched.tab.locator("input[inputmode=decimal]:visible").first
    watched.wait(lambda: time_field.input_value() == "3")
    time_field.fill("1.2")
    watched.wait(at(live, 12))
    live.step(18)
    watched.wait(at(live, 30))
    assert live.simulation.state_hash() == future


def test_a_click_on_an_entity_chooses_it_and_the_camera_follows_it(game):
    live, page, watched = game
    visitor = watched.visitor
    visitor.see_whole()
    visitor.choose(None)
    page.display.model_scale = 4.0
    page.display.version += 1
    frame = live.frame()
    # Nobody stands before the hunter who is nearest to the camera.
    eye = visitor._client.camera.position
    row = int(np.linalg.norm(frame.pos - eye, axis=1).argmin())
    who = int(frame.id[row])

    def is_chosen():
        watched.tab.mouse.click(*watched.place_of(frame.pos[row]))
        watched.tab.wait_for_timeout(700)
        return visitor.chosen is not None

    watched.wait(is_chosen)
    assert visitor.chosen == who
    watched.wait(lambda: watched.reads(f"{live.blocks[int(frame.block[row])]} {who}"))
    watched.press("a")
    watched.wait(lambda: visitor.camera.mode == "follow")
    before = np.array(frame.pos[row])
    live.step(10)
    live.settle()
    now = watched.wait(lambda: live.frame().row_of(who) >= 0 and live.frame()).pos[live.frame().row_of(who)]
    assert np.linalg.norm(now - before) > 5.0
    camera = visitor._client.camera
    watched.wait(lambda: np.allclose(camera.look_at, now, atol=0.5))
    page.display.model_scale = 1.0


def test_two_browsers_watch_on_their_own_and_steer_together(chromium, game):
    live, page, watched = game
    other = Watched(chromium, page, {"width": 500, "height": 360})
    try:
        other.visitor.choose(3)
        assert watched.visitor.chosen != 3
        there = live.step_number
        other.button("Step")
        other.wait(at(live, there + 1))
        for one in (watched, other):
            one.wait(lambda one=one: one.reads(f"t = {live.t:.2f} s"))
        assert not other.trouble
    finally:
        other.close()
    watched.wait(lambda: len(page.visitors()) == 1)


def test_a_browser_that_hangs_holds_up_neither_game_nor_page(chromium, game):
    live, page, watched = game
    flag = "--tussle-hangs"
    browser = another_browser(chromium, flag)
    hanging = Watched(browser, page, SMALL, is_awaited=False)
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
        pushed = page.pusher.n_pushed
        watched.wait(lambda: live.step_number >= 100)
        live.pause()
        live.seek(10.0)
        live.settle()
        assert live.simulation.state_hash() == calm
        assert page.pusher.n_pushed > pushed + 1
        watched.wait(lambda: watched.reads("t = 10.00 s"))
    finally:
        send_all(family, signal.SIGCONT)
        live.warp = 1.0
    hanging.close()
    browser.close()
