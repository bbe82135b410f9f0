"""A map on the page of a live game, of a replay and of an exported run lies under the entities; the pointer says where on Earth it is."""

from __future__ import annotations

import io
import re

import matplotlib.image
import numpy as np
import pytest
from PIL import Image
from recorded_games import hunt, record
from served import Watched
from waiting import wait_until

from tussle import Block, Mission, Scene, Simulation
from tussle.scene import Base, Origin
from tussle.stock import Boundary, FlagCaptureInteraction, Still
from tussle.view import GroundMap, Live, Recording
from tussle.view.export.html import write_html
from tussle.view.page.server import Page

ORIGIN = Origin.from_degrees(-33.9, 18.4, 30.0)
PLACES = {1: (-180.0, 120.0, 0.0), 2: (120.0, 0.0, 0.0)}
"""Where the two robots stand [m], by their ids."""
PHOTO, CELL = (600, 500), 2e-5


def mission() -> Mission:
    blocks = [
        Block(name=f"robot_{who}", team=who, position=place, motion=Still()) for who, place in PLACES.items()
    ]
    fences = [
        Boundary(name="camp", boundary_id=1, team=1, shape="sphere", center=(-150, -150, 0), radius=20),
        Boundary(boundary_id=2, team=2, shape="sphere", center=(100, 150, 0), radius=20),
    ]
    scene = Scene(origin=ORIGIN, bases=(Base(2, (0.0, 100.0, 0.0), 25.0),))
    flag = FlagCaptureInteraction(flag_boundary_id=1, capture_boundary_id=2)
    return Mission(blocks=blocks, end=0.2, dt=0.1, scene=scene, interactions=[*fences, flag])


@pytest.fixture(scope="module")
def ground_map(tmp_path_factory):
    """A grey picture with a magenta square where the first robot stands, and a green one where the second does."""
    west, north = 18.4 - 0.5 * CELL * PHOTO[0], -33.9 + 0.5 * CELL * PHOTO[1]
    image = np.full((PHOTO[1], PHOTO[0], 3), 200, np.uint8)
    for who, colour in ((1, (255, 0, 255)), (2, (0, 255, 0))):
        latitude, longitude, _ = np.degrees(ORIGIN.to_geodetic(PLACES[who]))
        row, column = round((north - latitude) / CELL), round((longitude - west) / CELL)
        image[row - 6 : row + 6, column - 6 : column + 6] = colour
    path = tmp_path_factory.mktemp("map") / "photo.png"
    Image.fromarray(image).save(path)
    return GroundMap(path, (west, north - CELL * PHOTO[1], west + CELL * PHOTO[0], north))


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return record(mission(), tmp_path_factory.mktemp("map") / "run")


def assert_under_the_robots(tab):
    """Assert that the squares are under the robots that they belong to, seen from above."""
    tab.keyboard.press("v")
    wait_until(tab, "player.isDrawn && player.camera.pitch > 1.57")
    seen = matplotlib.image.imread(io.BytesIO(tab.screenshot()))[..., :3]
    for who, own, others in ((1, (0, 2), (1,)), (2, (1,), (0, 2))):
        is_mine = (seen[..., own].min(axis=2) > 0.4) & (seen[..., others].max(axis=2) < 0.25)
        assert is_mine.sum() > 100
        x, y = (np.flatnonzero(is_mine.any(axis=axis)) for axis in (0, 1))
        middle = 0.5 * (x.min() + x.max()), 0.5 * (y.min() + y.max())
        assert middle == pytest.approx(tab.evaluate(f"() => player.pixelOf({who})"), abs=3.0)


def degrees_of(text):
    """Latitude and longitude in a text of the page."""
    found = re.fullmatch(r"([\d.]+)° ([NS]),? ?([\d.]+)° ([EW])", text)
    assert found, text
    return [float(found[i]) * (-1 if found[i + 1] in "SW" else 1) for i in (1, 3)]


def test_a_live_game_lies_on_its_map_and_says_where_it_is(chromium, ground_map):
    with (
        Simulation(mission(), 1) as simulation,
        Live(simulation, is_paused=True, ground_map=ground_map) as live,
        Page(live) as page,
    ):
        watched = Watched(chromium, page)
        tab = watched.tab
        watched.wait("player.isDrawn")
        assert_under_the_robots(tab)
        expected = np.degrees(ORIGIN.to_geodetic(PLACES[2]))[:2]
        assert tab.locator("#pointer").inner_text() == ""
        tab.mouse.move(*tab.evaluate("() => player.pixelOf(2)"))
        assert degrees_of(tab.locator("#pointer").inner_text()) == pytest.approx(expected.tolist(), abs=2e-5)
        watched.choose(2)
        watched.wait("player.isDrawn")
        facts = dict(
            zip(
                *(tab.locator(f"#chosen > dl {name}").all_inner_texts() for name in ("dt", "dd")), strict=True
            )
        )
        said = f"{facts['Latitude']}, {facts['Longitude']}"
        assert degrees_of(said) == pytest.approx(expected.tolist(), abs=1e-6)
        tab.mouse.move(30, 30)  # over a panel
        watched.wait("document.getElementById('pointer').textContent === ''")
        watched.close()
        assert not watched.trouble, "\n".join(watched.trouble)


def test_bases_and_boundaries_are_named_until_labels_are_switched_off(chromium, ground_map):
    names = {"camp (flag)", "Boundary 2 (capture)", "base of robot_2"}
    with Simulation(mission(), 1) as simulation, Live(simulation, is_paused=True) as live, Page(live) as page:
        watched = Watched(chromium, page)
        watched.wait("player.isDrawn")
        for are_shown in (True, False, True):
            watched.wait(f"player.isDrawn && player.drawn.labels === {str(are_shown).lower()}")
            texts = set(watched.tab.evaluate("() => player.texts"))
            assert names & texts == (names if are_shown else set())
            assert ("robot_1 1" in texts) == are_shown
            watched.press("l")
        watched.close()


def test_a_swarm_has_names_of_areas_from_the_start(chromium):
    swarm = mission().replace(
        blocks=[Block(name="swarm", count=40, position=(0, 0, 10), variance=(100, 100, 0), motion=Still())]
    )
    with Simulation(swarm, 1) as simulation, Live(simulation, is_paused=True) as live, Page(live) as page:
        watched = Watched(chromium, page)
        watched.wait("player.isDrawn && !player.drawn.labels")
        assert "Boundary 2 (capture)" in watched.tab.evaluate("() => player.texts")
        watched.close()


def test_a_replay_and_an_exported_page_lie_on_the_map(chromium, watched, ground_map, run, tmp_path):
    with Page(Recording(run, is_mapped=True, ground_map=ground_map), is_paused=True) as page:
        served = Watched(chromium, page)
        served.wait("player.isDrawn")
        assert_under_the_robots(served.tab)
        served.close()
    file = write_html(Recording(run, ground_map=ground_map), tmp_path / "page.html").path
    tab = watched(file.as_uri(), reduced_motion="reduce")
    tab.goto(file.as_uri())
    wait_until(tab, "Boolean(window.player && player.isReady) && player.isDrawn")
    assert_under_the_robots(tab)


def test_without_an_origin_the_page_names_no_place(chromium):
    with Simulation(hunt(), 1) as simulation, Live(simulation, is_paused=True) as live, Page(live) as page:
        watched = Watched(chromium, page)
        watched.wait("player.isDrawn")
        watched.tab.mouse.move(400, 250)
        watched.choose(live.frame().id[0])
        watched.wait("player.isDrawn")
        assert "East" in watched.tab.locator("#chosen > dl").inner_text()
        assert watched.tab.locator("#pointer").inner_text() == ""
        assert "Latitude" not in watched.tab.locator("#chosen > dl").inner_text()
        watched.close()
