"""Shapes that plugins draw are seen after their step, for their lifetime, in their world."""

import numpy as np
from watched_plugins import clickable

from tussle import Simulation
from tussle.view import Live
from tussle.view.drawn import DrawCollector


def test_shapes_of_the_last_step_and_those_that_last():
    live = Live(Simulation(clickable()), threaded=False)
    live.step()
    assert live.shapes() == ()  # nobody had asked before the step
    seen = []
    for _ in range(6):
        live.step()
        shapes = live.shapes()
        seen.append([(s.kind, round(s.t, 6)) for s in shapes])
        (arrows,) = [s for s in shapes if s.kind == "vectors"]
        assert arrows.attributes["pos"].shape == (3, 3)
        assert arrows.attributes["colour"] == (255, 0, 0)
    # A text of 0.35 s, drawn at the beginning of a step, is seen after that step and two more.
    assert seen[0] == [("vectors", 0.1), ("text", 0.1)]
    assert seen[3] == [("text", 0.2), ("text", 0.3), ("vectors", 0.4), ("text", 0.4)]
    assert seen[5] == [("text", 0.4), ("text", 0.5), ("vectors", 0.6), ("text", 0.6)]


def test_a_jump_in_time_clears_the_page_and_a_replay_fills_it_again():
    live = Live(Simulation(clickable()), threaded=False)
    live.shapes()
    live.step(30)
    assert len(live.shapes()) == 4
    live.seek(0.0)
    assert live.shapes() == ()
    live.step()
    assert [s.kind for s in live.shapes()] == ["vectors", "text"]


def test_shapes_are_copies():
    sim = Simulation(clickable())
    book = DrawCollector(sim, 0)
    book.open()
    book.open()
    sim.step()
    (arrows, _) = book.shapes()
    before = arrows.attributes["pos"].copy()
    sim.step(5)
    np.testing.assert_array_equal(arrows.attributes["pos"], before)
    book.close()
    assert sim.state.context.draw.sinks == []
    book.close()


def test_only_what_is_of_the_world_is_seen():
    sim = Simulation(clickable(), seeds=[1, 2])
    books = [DrawCollector(sim, world) for world in range(2)]
    for book in books:
        book.open()
    sim.step()
    for world, book in enumerate(books):
        arrows, text = book.shapes()
        np.testing.assert_array_equal(
            arrows.attributes["pos"], Simulation(clickable(), seeds=world + 1).read("drone.pos")[0][0].T
        )
        assert "world" not in arrows.attributes
        assert text.kind == "text"  # said of no world: seen in all
    draw = sim.state.context.draw
    for book in books:
        book.begin_step()
        book.clear()
    draw.sphere(pos=np.zeros(3), radius=2.0, world=1)
    draw.points(pos=np.zeros((3, 2)), world=np.array([0, 0]))
    assert [[s.kind for s in book.shapes()] for book in books] == [["points"], ["sphere"]]


def test_a_lifetime_that_is_none_stops_no_game():
    sim = Simulation(clickable())
    book = DrawCollector(sim, 0)
    book.open()
    sim.state.context.draw.text(pos=np.zeros(3), text="?", lifetime="long")
    assert len(book.shapes()) == 1
    book.begin_step()
    assert book.shapes() == ()
