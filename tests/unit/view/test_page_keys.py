"""Every key of the page does what its table says."""

import math
from pathlib import Path

import numpy as np
import pytest
from page_client import PageClient
from recorded_games import hunt

from tussle import Simulation
from tussle.view import Live
from tussle.view.page.camera import view_from_above, whole_view
from tussle.view.page.keys import KEYS, help_table, keys_of
from tussle.view.page.server import Page


@pytest.fixture(scope="module")
def game():
    with (
        Simulation(hunt(end=60.0, end_conditions="time"), 3) as simulation,
        Live(simulation, is_paused=True, pace=1.0) as live,
        Page(live) as page,
        PageClient(page.url) as client,
    ):
        client.wait(page.visitors)
        live.step(60)
        live.settle()
        yield live, page, client


def test_keys_that_do_different_things_are_different():
    pressed = [(key.key, key.with_shift) for key in KEYS]
    assert len(set(pressed)) == len(pressed)


def test_the_help_names_each_key_that_means_something():
    for is_live in (True, False):
        table = help_table(is_live)
        assert all(key.label in table and key.text in table for key in keys_of(is_live))
    assert "pick a point" not in help_table(is_live=False)


def test_the_page_of_the_guide_has_the_same_keys():
    guide = (Path(__file__).parents[3] / "docs" / "view.md").read_text()
    assert help_table(is_live=True) in guide


def test_all_keys_are_set(game):
    _, _, client = game
    client.wait(lambda: len(client.commands) == len(KEYS))


def test_keys_of_time(game):
    live, _, client = game
    client.press("B")
    client.wait(lambda: not live.is_paused)
    client.press("B")
    client.wait(lambda: live.is_paused and live.settle())
    there = live.step_number
    client.press("Space")
    client.wait(lambda: live.step_number == there + 1)
    client.press("Backspace")
    client.wait(lambda: live.step_number == there)
    for key, warp in (("]", 2.0), ("[", 1.0), ("[", 0.5), ("M", math.inf), ("M", 1.0)):
        client.press(key)
        client.wait(lambda warp=warp: live.warp == warp)


def test_keys_of_events(game):
    live, _, client = game
    times = sorted({h.t for h in live.happenings if h.t > 0.0})
    assert len(times) > 2
    live.seek(0.0)
    live.settle()
    for key, t in ((".", times[0]), (".", times[1]), (",", times[0])):
        client.press(key)
        client.wait(lambda t=t: live.t == pytest.approx(t) and live.settle())


def test_keys_of_what_is_shown(game):
    _, page, client = game
    display = page.display

    def has_labels():
        return any(name.startswith("/labels/") for name in list(client.nodes))

    client.wait(has_labels)
    for key, name in (("L", "has_labels"), ("T", "has_trails"), ("G", "has_links")):
        before = getattr(display, name)
        client.press(key)
        client.wait(lambda name=name, before=before: getattr(display, name) != before)
    client.press("W")
    client.wait(lambda: display.is_wireframe and client.nodes["/entities/aircraft"]["wireframe"])
    client.press("S")
    client.wait(lambda: not client.nodes["/entities/aircraft"]["wireframe"])
    client.wait(lambda: "/trails" in client.nodes)
    client.wait(lambda: not has_labels())
    for key, scale in (("Shift + +", 1.25), ("+", 1.25**2), ("-", 1.25), ("0", 1.0), ("=", 1.25), ("0", 1.0)):
        client.press(key)
        client.wait(lambda scale=scale: display.model_scale == pytest.approx(scale))
    client.press("N")
    client.wait(lambda: display.label_scale == pytest.approx(1.25))
    client.press("Shift + N")
    client.wait(lambda: display.label_scale == pytest.approx(1.0))


def test_keys_of_the_camera(game):
    live, page, client = game
    visitor = page.visitors()[0]
    ids = live.frame().id.tolist()
    client.press("→")
    client.wait(lambda: visitor.chosen == ids[0])
    client.press("→")
    client.wait(lambda: visitor.chosen == ids[1])
    client.press("←")
    client.press("←")
    client.wait(lambda: visitor.chosen == ids[-1])
    for mode in ("follow", "behind", "free", "follow"):
        client.press("A")
        client.wait(lambda mode=mode: visitor.camera.mode == mode)
        client.wait(lambda mode=mode: client.value("Mode") == mode)
    distance = visitor.camera._distance
    client.press("Z")
    client.wait(lambda: visitor.camera._distance == pytest.approx(0.8 * distance))
    client.press("Shift + Z")
    client.wait(lambda: visitor.camera._distance == pytest.approx(distance))
    client.press("V")
    client.wait(lambda: visitor.camera.mode == "free")

    def is_at(view):
        return lambda: np.allclose(client.camera["position"], view.position, rtol=1e-4)

    client.wait(is_at(view_from_above(live.scenery)))
    client.press("R")
    client.wait(is_at(whole_view(live.scenery)))
    client.press("U")
    client.wait(is_at(view_from_above(live.scenery)))
    client.press("U")
    client.wait(lambda: visitor.camera.mode == "follow")


def test_the_key_for_help_shows_the_keys(game):
    _, _, client = game
    client.press("H")
    client.wait(
        lambda: sum("one step back" in (e.get("_markdown") or "") for e in list(client.inputs.values())) == 2
    )
