"""Entities that are boxes are drawn as boxes of their lengths: on the page and in films; see test_mcap.py for MCAP files."""

from __future__ import annotations

import numpy as np
import pytest
from page_reader import PageReader
from recorded_games import record

from tussle import Block, Mission
from tussle.stock import Still
from tussle.view import Recording
from tussle.view.export.film.cameras import View
from tussle.view.export.film.renderer import Renderer
from tussle.view.export.html import write_html
from tussle.view.scenery import Scenery
from tussle.view.style import Style

BOX = (8.0, 4.0, 2.0)


@pytest.fixture(scope="module")
def stood(tmp_path_factory):
    """A box that is turned to the north, and a robot that is none."""
    blocks = [
        Block(name="crate", team=1, heading="90 deg", box=BOX, motion=Still()),
        Block(name="robot", team=2, position=(0, 30, 0), motion=Still()),
    ]
    return Recording(record(Mission(blocks=blocks, end=1.0), tmp_path_factory.mktemp("runs") / "boxes"))


def test_the_page_is_told_the_lengths_of_a_recorded_box(stood, tmp_path):
    write_html(stood, tmp_path / "page.html")
    document = PageReader(tmp_path / "page.html").document
    assert [(b["model"], b["lengths"]) for b in document["blocks"]] == [
        ("box", [*BOX]),
        ("sphere", [1, 1, 1]),
    ]
    corners = np.array(document["models"]["box"]["vertices"]).reshape(-1, 3)
    assert (corners.min(axis=0).tolist(), corners.max(axis=0).tolist()) == ([-0.5] * 3, [0.5] * 3)


def test_a_visual_model_takes_the_place_of_the_box():
    style = Style(["crate"], [1], viewer={"entities": {"crate": {"visual_model": "zephyr"}}}, boxes=[BOX])
    assert (style.model(0), style.lengths(0), style.is_true_box(0)) == ("aircraft", (1.0, 1.0, 1.0), False)
    cube = Style(
        ["crate"], [1], viewer={"entities": {"crate": {"visual_model": "crate", "visual_scale": "3"}}}
    )
    assert (cube.model(0), cube.lengths(0), cube.is_true_box(0)) == ("box", (3.0, 3.0, 3.0), False)


@pytest.mark.needs("renderer")
def test_a_film_shows_a_box_in_its_lengths_and_attitude(stood):
    low, high = np.full(3, -50.0), np.full(3, 50.0)
    frame = stood.frame(0)
    view = View(
        np.array([0.0, 0.0, 100.0]),
        np.zeros(3),
        np.array([0.0, 1.0, 0.0]),
        8.0,
        is_parallel=True,
        model_length=10.0,
    )
    with Renderer(
        stood.style, Scenery(stood.scenery.origin, 0.0, 0.0, low, high, 1000.0), (96, 96)
    ) as renderer:
        renderer.show(frame, view)
        picture = renderer.picture().astype(int)
    is_box = picture[..., 2] - picture[..., 0] > 40  # team 1 is blue
    metres = 16.0 / 96
    high_m, wide_m = (np.ptp(np.flatnonzero(is_box.any(axis=axis))) * metres for axis in (1, 0))
    assert high_m == pytest.approx(BOX[0], abs=3 * metres)
    assert wide_m == pytest.approx(BOX[1], abs=3 * metres)
