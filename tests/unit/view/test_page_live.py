"""The page of a live game, as one sees it who speaks its protocol: what is sent, and what each command does."""

import struct
import threading
import time

import numpy as np
import pytest
from aiohttp import ClientConnectionResetError
from aiohttp.web import WebSocketResponse
from page_client import PageClient, browsed
from recorded_games import hunt
from watched_plugins import failing

from tussle import Block, Mission, Simulation
from tussle.stock import Still
from tussle.view import Live
from tussle.view.page.server import Page


@pytest.fixture
def game():
    """A page on a game that stands still at its beginning, and who watches it."""
    with browsed(hunt(end=60.0, end_conditions="time"), 3, is_paused=True, pace=20.0) as (live, page, client):
        client.wait(lambda: client.n_frames and client.status)
        yield live, page, client
        assert page.error is None


def stands_at(live, step):
    return lambda: live.step_number == step and live.settle()


def test_entities_are_sent_where_they_are(game):
    live, _, client = game
    assert sorted(client.frame) == live.frame().id.tolist()
    live.step(5)
    client.wait(lambda: client.t == pytest.approx(0.5))
    frame = live.frame()
    for row, who in enumerate(frame.id.tolist()):
        seen = client.frame[who]
        assert np.abs(seen.pos - frame.pos[row]).max() <= 0.001 + 1e-9
        assert abs(seen.quat @ frame.quat[row]) > 1.0 - 1e-6
        assert (seen.team, seen.block, seen.health) == (frame.team[row], frame.block[row], 1.0)


def test_only_the_first_of_several_steers_where_one_steers():
    with (
        Simulation(hunt(), 3) as simulation,
        Live(simulation, is_paused=True) as live,
        Page(live, one_steers=True) as page,
        PageClient(page.url) as first,
        PageClient(page.url) as second,
    ):
        second.wait(lambda: second.status and not second.status["steers"])
        second.order("step", n=1)
        second.wait(lambda: second.refusals == ["another browser steers this game"])
        second.order("choose", id=1)
        second.wait(lambda: second.status["entity"])
        first.order("step", n=1)
        first.wait(stands_at(live, 1))
        first.close()
        second.wait(lambda: second.status["steers"])
        second.order("step", n=1)
        second.wait(stands_at(live, 2))


def test_closing_all_browsers_leaves_the_game_going(game):
    live, page, client = game
    live.resume()
    client.close()
    client.wait(lambda: not page.n_readers)
    there, made = live.step_number, page.publisher.n_made
    client.wait(lambda: live.step_number > there + 5)
    assert page.publisher.n_made - made <= 1, "nobody watches, and yet frames are made"


@pytest.mark.slow
def test_a_browser_that_hangs_holds_up_nobody_and_costs_no_memory():
    crowd = Block(name="all", count=20_000, placement="uniform", half_width=(500, 500, 100), motion=Still())
    with (
        Simulation(Mission(blocks=[crowd], end=1e6), 3) as simulation,
        Live(simulation, pace=None) as live,
        Page(live) as page,
        PageClient(page.url, is_reading=False) as hanging,
        PageClient(page.url) as client,
    ):
        client.wait(lambda: page.n_readers == 2)
        reader = page.publisher.readers[0]
        client.wait(lambda: page.publisher.n_made - reader.frame_sent > 10)
        held = reader.socket._req.transport.get_write_buffer_size()
        assert held < 2 * len(page.publisher._frame), "what a slow browser has not taken is kept for it"
        seen, there = client.n_frames, live.step_number
        client.wait(lambda: client.n_frames > seen + 3 and live.step_number > there + 3)
        assert hanging.n_frames == 0


def test_events_are_told_once_and_again_where_the_game_takes_another_course(game):
    live, _, client = game
    live.step(60)
    live.settle()
    client.wait(lambda: len(client.events) == len(live.events) > 14)
    assert client.events[-1] == [getattr(live.events[-1], k) for k in ("t", "kind", "id", "other", "text")]
    client.wait(lambda: client.status["events"]["rows"] == [])
    client.order("seek", t=1.0)
    client.order("key", key=";")
    client.wait(lambda: live.injections)
    live.settle()
    client.wait(lambda: len(client.events) == len(live.events) < 60)
    assert client.events[-1][0] < 1.0 + 1e-9


def test_begin_anew_with_another_seed(game):
    live, _, client = game
    live.step(5)
    client.order("reset", seed=11)
    client.wait(lambda: live.seed == 11)
    client.wait(stands_at(live, 0))
    client.wait(lambda: client.status["seed"] == 11)


def test_the_status_says_what_goes_on(game):
    live, _, client = game
    live.step(30)
    client.wait(lambda: client.status["step"] == 30 and client.status["metrics"])
    status = client.status
    n_caught = sum(event.kind == "capture" for event in live.events)
    assert status["span"] == [0.0, pytest.approx(3.0)]
    assert (status["isPaused"], status["isOver"], status["error"]) == (True, False, None)
    assert ["SimpleCaptureMetrics NonTeamCapture", f"prey, late 0, hunters {n_caught}"] in status["metrics"]


def test_a_look_back_holds_what_was_seen(game):
    live, _, client = game
    live.step(30)
    client.wait(lambda: client.t == pytest.approx(3.0))
    client.order("history", seconds=1.0)
    seconds, chunk = client.wait(lambda: client.past and client.past[-1])
    assert seconds == 1.0
    assert chunk.t[0] == pytest.approx(2.0, abs=0.11)
    assert chunk.t[-1] == pytest.approx(3.0)
    assert (np.diff(chunk.t) > 0.0).all()
    then = live.frame_at(float(chunk.t[0]))
    assert sorted(chunk.frames[0]) == then.id.tolist()
    assert np.allclose(chunk.frames[0][1].pos, then.pos[then.row_of(1)], atol=0.01)


def test_a_plugin_that_fails_is_told_and_the_game_can_be_wound_back():
    with browsed(failing(), 1, pace=None) as (live, page, client):
        client.wait(lambda: "it is late" in (client.status.get("error") or ""))
        assert page.game_error is live.error
        there = live.step_number
        client.order("step", n=-1)
        client.wait(stands_at(live, there - 1))
        client.wait(lambda: client.status["error"] is None)


def test_the_missions_time_between_frames_counts():
    with (
        Simulation(hunt(end=60.0, end_conditions="time"), 3) as simulation,
        Live(simulation, viewer={"gui_update_period": "200"}) as live,
    ):
        with Page(live) as page, PageClient(page.url) as client:
            client.wait(lambda: client.n_frames >= 2)
            began, seen = time.monotonic(), client.n_frames
            client.wait(lambda: client.n_frames >= seen + 4)
            assert time.monotonic() - began > 0.5
        with Page(live, viewer={"gui_update_period": "soon"}) as page:
            assert (
                "gui_update_period 'soon' is no time in ms; frames are sent as fast as can be" in page.notes
            )


def test_a_page_that_ends_leaves_no_thread_and_no_port():
    with Simulation(hunt(), 1) as simulation, Live(simulation, is_paused=True) as live:
        before = threading.active_count()
        page = Page(live)
        client, hanging = PageClient(page.url), PageClient(page.url, is_reading=False)
        client.wait(lambda: client.n_frames and page.n_readers == 2)
        page.stop()
        page.stop()
        client.wait(lambda: client.error is not None)
        hanging.close()
        client.wait(lambda: threading.active_count() <= before)
        with pytest.raises(OSError, match="Cannot connect"):
            PageClient(page.url)


@pytest.mark.parametrize("way", ["send_str", "send_bytes"])
def test_a_browser_that_goes_while_it_is_sent_something_is_no_error_of_the_page(game, monkeypatch, way):
    """As aiohttp says it; which message is under way at that moment is chance."""
    live, page, _ = game
    sent = threading.Event()

    async def gone(socket, data):
        sent.set()
        raise ClientConnectionResetError("Cannot write to closing transport")

    with monkeypatch.context() as patch:
        patch.setattr(WebSocketResponse, way, gone)
        live.step(5)
        assert sent.wait(60.0)
    with PageClient(page.url) as other:
        other.wait(lambda: other.t == pytest.approx(0.5))
        assert not other.status["notes"]


def test_the_header_of_a_message_leaves_its_numbers_on_whole_words():
    from tussle.view.page.publisher import message

    for kind in ("a", "ab", "abc", "abcd"):
        data = message({"kind": kind}, b"1234")
        (length,) = struct.unpack_from("<I", data)
        assert length % 4 == 0
        assert data[4 + length :] == b"1234"
