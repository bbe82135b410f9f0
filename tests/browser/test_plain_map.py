"""The plain map: the whole page in a browser without WebGL, and the way there and back in one that has it."""

import numpy as np
import pytest
from recorded_games import record
from served import UNHURRIED, Watched, another_browser
from test_orders import mission

from tussle import Simulation
from tussle.view import Live, Recording
from tussle.view.page.server import Page

COLOURS = """() => {
  const canvas = document.getElementById('plain');
  const pixels = new Uint32Array(canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data.buffer);
  const found = {};
  for (const pixel of pixels) found[pixel & 0xffffff] = (found[pixel & 0xffffff] || 0) + 1;
  return found;
}"""
"""Colours of the plain map, and of how many pixels."""


LOSE = """() => document.getElementById('view').getContext('webgl2').getExtension('WEBGL_lose_context').loseContext()"""


@pytest.mark.slow
def test_without_webgl_entities_are_drawn_chosen_and_ordered(chromium):
    browser = another_browser(chromium, "--disable-3d-apis")
    with (
        Simulation(mission(), 3) as simulation,
        Live(simulation, is_paused=True) as live,
        Page(live, viewer=UNHURRIED) as page,
    ):
        watched = Watched(browser, page, {"width": 1100, "height": 760})
        tab = watched.tab
        assert not tab.evaluate("() => Boolean(document.createElement('canvas').getContext('webgl2'))")
        watched.wait("player.isPlain && player.isDrawn")
        assert "plain map: this browser has no WebGL" in tab.locator("#said").inner_text()
        red, green, blue = live.style.block_colour(0)
        assert tab.evaluate(COLOURS)[str(red | green << 8 | blue << 16)] > 100
        watched.choose(2)
        watched.wait("!document.querySelector('#orders').hidden")
        pixel = tab.evaluate("() => player.pixelOf(2)")
        watched.button("Point on the ground")
        tab.mouse.click(pixel[0] + 120, pixel[1] - 80)
        watched.button("Send")
        watched.until(lambda: len(live.injections) == 1 and live.settle())
        frame = live.frame()
        live.step(3)
        assert live.settle()
        goal = live.simulation.read("drone.GoTo.goal")[0][0][1]
        east, north = goal[:2] - frame.pos[frame.row_of(2)][:2]
        assert north > 0
        assert east / north == pytest.approx(120 / 80, rel=0.05)
        x, y = pixel
        watched.wait("player.frame === 3 && player.isDrawn")
        before = np.array(tab.evaluate("() => player.pixelOf(1)"))
        tab.mouse.move(x + 200, y + 150)
        tab.mouse.down()
        tab.mouse.move(x + 260, y + 130, steps=4)
        tab.mouse.up()
        watched.wait("player.isDrawn")
        assert tab.evaluate("() => player.pixelOf(1)") == pytest.approx(before + np.array([60, -20]), abs=1.5)
        watched.press("2")
        assert "3D needs WebGL 2" in tab.locator("#said").inner_text()
        assert tab.evaluate("() => player.isPlain")
        watched.close()
        assert not watched.trouble, "\n".join(watched.trouble)
    browser.close()


def test_the_key_and_the_settings_switch_to_the_map_and_back(chromium, tmp_path):
    run = Recording(record(mission().replace(end=2.0), tmp_path / "run", (3,)))
    with Page(run, is_paused=True) as page:
        watched = Watched(chromium, page)
        tab = watched.tab
        watched.wait("player.isDrawn")
        watched.press("2")
        watched.wait("player.isPlain && player.isDrawn")
        watched.press("End")
        watched.wait("player.t >= 2 && player.isDrawn")
        frame = run.frame(-1)
        there = np.array([tab.evaluate("(id) => player.pixelOf(id)", who) for who in frame.id.tolist()])
        apart, metres = there[1:] - there[0], (frame.pos[1:] - frame.pos[0])[:, :2] * (1, -1)
        scale = np.linalg.norm(apart) / np.linalg.norm(metres)
        np.testing.assert_allclose(apart, scale * metres, atol=0.5)
        watched.press("d")
        assert tab.locator("#plain-map").is_checked()
        tab.locator("#plain-map").click()
        watched.wait("!player.isPlain && player.isDrawn")
        assert tab.locator("#plain").is_hidden()
        assert not watched.trouble, "\n".join(watched.trouble)
        tab.evaluate(LOSE)
        watched.wait("player.isPlain && player.isDrawn")
        watched.press("2")
        watched.wait("document.getElementById('said').textContent.includes('3D needs WebGL 2')")
        assert all("CONTEXT_LOST" in text for text in watched.trouble), "\n".join(watched.trouble)
        watched.close()


def test_a_browser_that_draws_3d_slowly_is_given_the_map(chromium, tmp_path):
    run = Recording(record(mission().replace(end=2.0), tmp_path / "run", (3,)))
    with Page(run, is_paused=True) as page:
        tab = chromium.new_page()
        # Each look at a pixel takes a fifth of a second.
        tab.add_init_script(
            """const read = WebGL2RenderingContext.prototype.readPixels;
            WebGL2RenderingContext.prototype.readPixels = function (...all) {
              const end = performance.now() + 200;
              while (performance.now() < end);
              return read.apply(this, all);
            };"""
        )
        tab.goto(page.url)
        tab.wait_for_selector("#plain:not([hidden])", state="attached")
        said = tab.locator("#said").inner_text()
        assert (
            "plain map: this browser draws 3D at 4." in said
            or "plain map: this browser draws 3D at 3." in said
        )
        tab.close()
