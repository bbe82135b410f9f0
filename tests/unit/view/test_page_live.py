"""The page of a live game, as one sees it who speaks viser's protocol: what is sent, and what each control does."""

import time

import numpy as np
import pytest
from page_client import PageClient
from recorded_games import hunt
from watched_plugins import clickable, failing

from tussle import Simulation
from tussle.messages import CustomKeyPress, WorldPointClicked
from tussle.view import Live
from tussle.view.page.server import Page


@pytest.fixture
def game():
    """A page on a game that stands still at its beginning, and who watches it."""
    with (
        Simulation(hunt(end=60.0, end_conditions="time"), 3) as simulation,
        Live(simulation, is_paused=True, pace=20.0) as live,
        Page(live) as page,
        PageClient(page.url) as client,
    ):
        client.wait(page.visitors)
        yield live, page, client
        assert page.error is None


def stands_at(live, step):
    return lambda: live.step_number == step and live.settle()


def test_entities_are_sent_where_they_are(game):
    live, _, client = game
    client.wait(lambda: "/entities/aircraft" in client.nodes)
    assert np.allclose(client.positions("aircraft"), live.frame().pos, atol=1e-3)
    live.step(5)
    client.wait(lambda: client.n_frames)
    client.wait(lambda: np.allclose(client.positions("aircraft"), live.frame().pos, atol=1e-3))


def test_pause_stops_the_clock_and_play_moves_it(game):
    live, _, client = game
    client.set("Run", "Play")
    client.wait(lambda: live.step_number > 3)
    client.set("Run", "Pause")
    client.wait(lambda: live.is_paused)
    live.settle()
    there = live.step_number
    time.sleep(0.3)
    assert live.step_number == there
    assert client.wait(lambda: client.text("paused"))


def test_step_and_step_back_move_by_one(game):
    live, _, client = game
    client.set("Run", "Step")
    client.wait(stands_at(live, 1))
    first = live.simulation.state_hash()
    client.set("Run", "Step")
    client.wait(stands_at(live, 2))
    client.set("Run", "Back")
    client.wait(stands_at(live, 1))
    assert live.simulation.state_hash() == first


def test_the_slider_goes_back_and_the_future_is_the_same(game):
    live, _, client = game
    live.step(40)
    client.wait(stands_at(live, 40))
    future = live.simulation.state_hash()
    client.wait(lambda: client.value("Time [s]") == pytest.approx(live.t))
    client.set("Time [s]", 1.0)
    client.wait(stands_at(live, 10))
    live.step(30)
    client.wait(stands_at(live, 40))
    assert live.simulation.state_hash() == future


def test_speed_buttons(game):
    live, _, client = game
    for button, warp in (("Max", np.inf), ("1 ×", 1.0), ("Faster", 2.0), ("Faster", 3.0), ("Slower", 2.0)):
        client.set("Speed", button)
        client.wait(lambda warp=warp: live.warp == warp)


def test_a_click_selects_and_is_followed(game):
    live, page, client = game
    visitor = page.visitors()[0]
    who = max(live.frame().id.tolist())
    client.click("/entities/aircraft", live.frame().row_of(who))
    client.wait(lambda: visitor.chosen == who)
    about = client.wait(lambda: client.text("Predator"))
    assert f"hunters {who}" in about

    def is_looked_at():
        frame = live.frame()
        return np.allclose(client.camera.get("target", np.nan), frame.pos[frame.row_of(who)], atol=1e-2)

    client.set("Mode", "follow")
    client.wait(is_looked_at)
    before = client.camera["target"]
    live.step(20)
    client.wait(stands_at(live, 20))
    client.wait(is_looked_at)
    assert np.linalg.norm(np.subtract(client.camera["target"], before)) > 10.0


def test_each_browser_has_a_camera_and_a_choice_of_its_own(game):
    _, page, client = game
    with PageClient(page.url) as other:
        other.wait(lambda: len(page.visitors()) == 2)
        client.set("Entity", 2)
        client.wait(lambda: sorted(str(v.chosen) for v in page.visitors()) == ["2", "None"])
        other.wait(lambda: other.text("Click an entity"))
    client.wait(lambda: len(page.visitors()) == 1)


def test_closing_all_browsers_leaves_the_game_going(game):
    live, page, client = game
    live.resume()
    client.close()
    client.wait(lambda: not page.visitors())
    there = live.step_number
    client.wait(lambda: live.step_number > there + 5)
    pushed = page.pusher.n_pushed
    time.sleep(0.4)
    assert page.pusher.n_pushed - pushed <= 1, "nobody watches, and yet frames are made"


def test_a_browser_that_hangs_holds_up_nobody(game):
    live, page, client = game
    with PageClient(page.url, is_reading=False):
        client.wait(lambda: len(page.visitors()) == 2)
        live.resume()
        there, seen = live.step_number, client.n_frames
        client.wait(lambda: live.step_number > there + 20 and client.n_frames > seen + 5)
        buffer = page._server._websock_server._broadcast_buffer
        held = len(buffer.message_from_id)
        client.wait(lambda: live.step_number > there + 60)
        assert len(buffer.message_from_id) <= held + 50, "what a slow browser has not taken is kept for it"


def test_a_point_of_the_ground_is_told_to_the_plugins():
    with (
        Simulation(clickable(), 1) as simulation,
        Live(simulation, is_paused=True) as live,
        Page(live) as page,
        PageClient(page.url) as client,
    ):
        client.wait(page.visitors)
        client.press("O")
        client.wait(lambda: client.notifications)
        client.click_ground((0.0, 0.0, 100.0), (0.3, 0.4, -1.0))
        client.wait(lambda: live.injections)
        (said,) = live.injections
        assert said.type is WorldPointClicked
        assert np.allclose(said.fields["pos"], (30.0, 40.0, 0.0))
        client.click_ground((0.0, 0.0, 100.0), (0.3, 0.4, -1.0))
        client.press(";")
        client.wait(lambda: len(live.injections) == 2)
        assert live.injections[1].type is CustomKeyPress, "a second click is no second point"


def test_a_click_into_the_sky_is_no_point():
    with (
        Simulation(clickable(), 1) as simulation,
        Live(simulation, is_paused=True) as live,
        Page(live) as page,
        PageClient(page.url) as client,
    ):
        client.wait(page.visitors)
        client.press("O")
        client.wait(lambda: client.notifications)
        client.click_ground((0.0, 0.0, 100.0), (0.3, 0.4, 1.0))
        client.wait(lambda: len(client.notifications) == 2)
        assert not live.injections


def test_what_plugins_draw_is_seen():
    with (
        Simulation(clickable(), 1) as simulation,
        Live(simulation, is_paused=True) as live,
        Page(live) as page,
        PageClient(page.url) as client,
    ):
        client.wait(page.visitors)
        client.wait(lambda: live._sketchbook.is_open)
        live.step()
        client.wait(lambda: "/drawn/arrows" in client.nodes and "/drawn/text 0" in client.nodes)
        assert client.nodes["/drawn/text 0"]["text"] == "goal"


def test_begin_anew_with_another_seed(game):
    live, _, client = game
    live.step(5)
    client.set("Seed", 11)
    client.wait(lambda: client.value("Seed"))
    button = client.id_of("Begin anew")
    time.sleep(0.1)
    client.send("GuiUpdateMessage", uuid=button, updates={"value": True})
    client.wait(lambda: live.seed == 11)
    client.wait(stands_at(live, 0))


def test_the_numbers_say_what_goes_on(game):
    live, _, client = game
    live.step(30)
    numbers = client.wait(lambda: client.text("step 30"))
    for part in ("t = 3.00 s", "paused", "team 1", "prey", "hunters", "× real time", "frames/s", "score"):
        assert part in numbers
    client.wait(lambda: "capture" in client.text("step 30"))


def test_a_plugin_that_fails_is_told_on_the_page():
    with (
        Simulation(failing(), 1) as simulation,
        Live(simulation, pace=None) as live,
        Page(live) as page,
        PageClient(page.url) as client,
    ):
        client.wait(lambda: client.text("it is late"))
        there = live.step_number
        client.set("Run", "Back")
        client.wait(stands_at(live, there - 1))


def test_who_is_gone_is_drawn_no_more_and_said_to_be_gone():
    with (
        Simulation(hunt(end=30.0, end_conditions="time"), 3) as simulation,
        Live(simulation, is_paused=True, pace=None) as live,
        Page(live) as page,
        PageClient(page.url) as client,
    ):
        client.wait(page.visitors)
        live.step(60)
        live.settle()
        dead = next(h.id for h in live.happenings if h.kind == "death")
        client.wait(lambda: len(client.positions("aircraft")) == len(live.frame()))
        client.set("Entity", dead)
        client.wait(lambda: client.text("is not there at this time"))
