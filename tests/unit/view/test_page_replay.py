"""Recorded runs behind the controls of a live game: time, events, and where two of them part."""

import time

import numpy as np
import pytest
from page_client import PageClient
from recorded_games import hunt

from tussle import Recorder, Simulation
from tussle.errors import ViewError
from tussle.view import Recording
from tussle.view.page.comparing import Comparison, first_difference, what_differs
from tussle.view.page.replaying import PlayHead, Replay
from tussle.view.page.server import Page


def recorded(folder, seed=3, steps=40, **changes):
    with Simulation(hunt(**changes), seed) as simulation, Recorder(simulation, folder):
        simulation.step(steps)
    return folder


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """A run, the same again and longer, and one with another seed."""
    base = tmp_path_factory.mktemp("runs")
    return (
        recorded(base / "one"),
        recorded(base / "longer", steps=50),
        recorded(base / "other", seed=4),
    )


# -- the place in time ------------------------------------------------------------------------------------------------------------


def test_the_head_moves_with_the_clock_and_stops_at_the_end():
    head = PlayHead(np.arange(5) * 0.1, warp=4.0)
    time.sleep(0.02)
    assert 0.0 < head.t <= 0.4
    time.sleep(0.15)
    assert head.t == head.last == pytest.approx(0.4)
    assert head.pace == 0.0
    head.warp = 1e-6
    head.resume()
    assert head.t < 0.4, "at the end, it plays again"


def test_the_head_stands_still_where_it_is_put():
    head = PlayHead(np.arange(5) * 0.1, is_paused=True)
    head.seek(0.25)
    assert head.t == 0.25
    head.step(1)
    assert head.t == pytest.approx(0.3)
    head.step(-1)
    assert head.t == pytest.approx(0.2)
    head.step(-9)
    assert head.t == 0.0
    head.step(99)
    assert head.t == pytest.approx(0.4)
    head.seek(-7.0)
    assert head.t == 0.0


def test_another_warp_starts_from_the_present():
    head = PlayHead(np.arange(1000) * 0.1, warp=100.0)
    time.sleep(0.05)
    head.warp = 1e-6
    t = head.t
    assert t > 2.0
    time.sleep(0.02)
    assert head.t == pytest.approx(t, abs=1e-3)


# -- one run ----------------------------------------------------------------------------------------------------------------------


def test_a_replay_shows_what_was_recorded(runs):
    replay = Replay(Recording(runs[0]), is_paused=True)
    replay.seek(2.05)
    assert replay.frame().step == 20
    replay.step()
    assert replay.frame().step == 21
    replay.step_back(2)
    assert replay.frame().step == 19
    who = int(replay.frame().id[2])
    state = replay.entity(who)
    assert np.array_equal(state.body["pos"].value, replay.frame().pos[2])
    assert state.body["speed"].value == pytest.approx(np.linalg.norm(replay.frame().vel[2]))
    assert replay.entity(10_000) is None


def test_a_replay_on_the_page_plays_and_jumps_to_events(runs):
    replay = Replay(Recording(runs[0]), is_paused=True)
    with Page(replay, mission=replay.mission, viewer=replay.viewer) as page, PageClient(page.url) as client:
        client.wait(page.visitors)
        client.set("Jump", "Next event")
        first = min(h.t for h in replay.happenings if h.t > 0.0)
        client.wait(lambda: replay.t == first)
        client.wait(lambda: client.value("Time [s]") == pytest.approx(first))
        events = client.inputs[client.id_of("Event")]["options"]
        assert len(events) > 3
        client.set("Event", events[-1])
        client.wait(lambda: replay.t > first)
        t = replay.t
        assert events[-1].split()[1] == f"{t:.2f}"
        client.set("Jump", "Last event")
        client.wait(lambda: replay.t < t)
        client.set("Time [s]", 1.0)
        client.wait(lambda: replay.t == 1.0)
        client.set("Run", "Play")
        client.wait(lambda: replay.t > 1.2)
        client.wait(lambda: np.allclose(client.positions("aircraft"), page.source.frame().pos, atol=30.0))
        assert not [c for c in client.commands.values() if c["description"] == "O"], "nobody hears of a point"
        assert page.error is None


# -- two runs ---------------------------------------------------------------------------------------------------------------------


def test_the_same_game_twice_does_not_differ(runs):
    one, longer = Recording(runs[0]), Recording(runs[1])
    assert first_difference(one, longer) is None
    notes = Comparison(one, longer).notes
    assert any("do not differ up to t = 4 s" in note for note in notes)


def test_two_runs_begin_where_they_part_and_say_what_differs(runs):
    a, b = Recording(runs[0]), Recording(runs[2])
    pair = Comparison(a, b, is_paused=True)
    assert pair.difference.step == 0
    assert pair.t == 0.0
    assert any("they differ first at t = 0 s (step 0): pos of entities" in note for note in pair.notes)
    assert any(h.kind == "difference" for h in pair.happenings)


def test_the_first_difference_is_found_after_a_common_beginning(tmp_path):
    with Simulation(hunt(), 3) as simulation, Recorder(simulation, tmp_path / "a"):
        simulation.step(20)
    with Simulation(hunt(), 3) as simulation, Recorder(simulation, tmp_path / "b"):
        simulation.step(12)
        speed, _ = simulation.read("hunters.vel")
        simulation.write("hunters.vel", speed * 1.5)
        simulation.step(8)
    found = first_difference(Recording(tmp_path / "a"), Recording(tmp_path / "b"))
    assert found.step in (12, 13)
    assert "of entities 13, 14, 15" in found.text


def test_runs_side_by_side_stand_apart_and_over_each_other_do_not(runs):
    a, b = Recording(runs[0]), Recording(runs[2])
    beside, over = Comparison(a, b, is_paused=True), Comparison(a, b, is_over_each_other=True, is_paused=True)
    n = len(a.at(0.0))
    assert beside.frame().pos[n:, 0].min() > beside.frame().pos[:n, 0].max()
    assert np.array_equal(over.frame().pos[n:], b.at(0.0).pos)
    frame = over.frame()
    assert (np.diff(frame.id) > 0).all()
    assert over.name_of(frame, 0).startswith("A prey 1")
    assert over.name_of(frame, n).startswith("B prey 1")
    assert over.looks.block_colour(0) != over.looks.block_colour(len(a.blocks))
    assert over.entity(int(frame.id[n])).block == "B prey"


def test_two_runs_on_the_page(runs):
    pair = Comparison(Recording(runs[0]), Recording(runs[2]), is_paused=True)
    with Page(pair, mission=pair.mission, viewer=pair.viewer) as page, PageClient(page.url) as client:
        client.wait(page.visitors)
        client.wait(lambda: client.text("they differ first"))
        assert len(client.positions("aircraft")) == len(pair.frame())
        client.press("Space")
        client.wait(lambda: pair.t > 0.0)
        assert page.error is None


def test_who_is_in_one_run_only_is_named(runs):
    frame = Recording(runs[0]).frame(0)
    fewer = type(frame)(*(v[2:] if isinstance(v, np.ndarray) else v for v in vars(frame).values()))
    assert what_differs(frame, fewer) == "entities 1, 2 only in A"
    assert what_differs(fewer, frame) == "entities 1, 2 only in B"
    assert what_differs(frame, frame) == ""


def test_a_run_without_moments_cannot_be_compared(runs, tmp_path):
    with Simulation(hunt(), 3) as simulation, Recorder(simulation, tmp_path / "none"):
        pass
    empty = Recording(tmp_path / "none")
    empty.t = empty.t[:0]
    with pytest.raises(ViewError, match="nothing was recorded"):
        Comparison(Recording(runs[0]), empty)
