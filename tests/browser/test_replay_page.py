"""A recorded run in a real browser: it plays, and jumps to an event."""

import pytest
from recorded_games import hunt
from served import UNHURRIED, Watched

from tussle import Recorder, Simulation
from tussle.view import Recording
from tussle.view.page.replaying import Replay
from tussle.view.page.server import Page


@pytest.fixture(scope="module")
def replayed(chromium, tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs") / "run"
    with (
        Simulation(hunt(n_prey=6, end=60.0, end_conditions="time"), 3) as simulation,
        Recorder(simulation, folder),
    ):
        simulation.step(200)
    replay = Replay(Recording(folder), is_paused=True)
    with Page(replay, mission=replay.mission, viewer=replay.viewer | UNHURRIED) as page:
        watched = Watched(chromium, page)
        yield replay, watched
        watched.close()
        assert not watched.trouble, "\n".join(watched.trouble)


def test_a_recorded_run_plays_and_stands_still(replayed):
    replay, watched = replayed
    watched.wait(lambda: watched.reads("t = 0.00 s"))
    watched.button("Play")
    watched.wait(lambda: replay.t > 0.3)
    watched.button("Pause")
    watched.wait(lambda: replay.is_paused)
    watched.wait(lambda: watched.reads(f"t = {replay.frame().t:.2f} s"))


def test_an_event_is_jumped_to(replayed):
    replay, watched = replayed
    replay.seek(0.0)
    first = min(h.t for h in replay.happenings if h.t > 0.0)
    watched.button("Next event")
    watched.wait(lambda: replay.t == first)
    watched.wait(lambda: watched.reads(f"t = {first:.2f} s"))
    assert watched.reads("death") or watched.reads("birth")


def test_one_frame_on_and_back(replayed):
    replay, watched = replayed
    replay.seek(1.0)
    watched.button("Step")
    watched.wait(lambda: replay.t == pytest.approx(1.1))
    watched.button("Back")
    watched.wait(lambda: replay.t == pytest.approx(1.0))
