"""Frames per second of the viewer page while it plays a recorded run, in Chromium.

    python benchmarks/page.py [--sizes 200 2000 20000] [--graphics-card]

Without --graphics-card everything is drawn in software, in 3D and as a plain map. `script` is the time that the page itself
takes for a frame; the rest of a frame is spent by the browser on drawing.
"""

from __future__ import annotations

import argparse
import shutil
import tempfile
from pathlib import Path

import scale
from playwright.sync_api import Browser, sync_playwright

from tussle import Recorder, Simulation
from tussle.view import Recording
from tussle.view.page.server import Page

SECONDS = 20
WINDOW = {"width": 1280, "height": 720}
MEASURE = """async (seconds) => {
    const begin = performance.now();
    const [frames, spent] = [window.spent.frames, window.spent.ms];
    await new Promise((done) => setTimeout(done, 1000 * seconds));
    const n = window.spent.frames - frames;
    return [(1000 * n) / (performance.now() - begin), (window.spent.ms - spent) / n];
}"""
COUNT = """window.spent = { frames: 0, ms: 0 };
const ask = window.requestAnimationFrame.bind(window);
window.requestAnimationFrame = (call) => ask((now) => {
    const begin = performance.now();
    call(now);
    window.spent.frames++;
    window.spent.ms += performance.now() - begin;
});"""


def recorded(n: int, folder: Path) -> Recording:
    """Boids at the density of `scale.py`, every half second for 10 s."""
    with Simulation(scale.mission(n).replace(end=10.0), 1) as game, Recorder(game, folder, period=0.5):
        game.run()
    return Recording(folder, is_mapped=True)


def measured(browser: Browser, n: int) -> list[tuple[float, float]]:
    """Frames per second, and time of the script per frame [ms]; in 3D, and as a plain map."""
    with tempfile.TemporaryDirectory() as folder, Page(recorded(n, Path(folder)), warp=0.3) as page:
        tab = browser.new_page(viewport=WINDOW)
        tab.add_init_script(COUNT)
        tab.goto(page.url)
        tab.wait_for_timeout(4000)
        found = []
        for is_plain in (False, True):
            if tab.evaluate("() => player.isPlain") != is_plain:
                tab.keyboard.press("2")
                tab.wait_for_timeout(2000)
            found.append(tuple(tab.evaluate(MEASURE, SECONDS)))
        tab.close()
    return found


def main() -> None:
    """Print a line for each size."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sizes", type=int, nargs="+", default=[200, 2000, 20_000])
    parser.add_argument("--graphics-card", action="store_true")
    asked = parser.parse_args()
    software = [] if asked.graphics_card else ["--enable-unsafe-swiftshader", "--use-angle=swiftshader"]
    with sync_playwright() as playwright:
        program = shutil.which("chromium") or shutil.which("chromium-headless-shell")
        browser = playwright.chromium.launch(executable_path=program, args=["--no-sandbox", *software])
        print("entities  3D: frames/s  script [ms]  map: frames/s  script [ms]")
        for n in asked.sizes:
            (rate, ms), (plain_rate, plain_ms) = measured(browser, n)
            print(f"{n:8,}  {rate:12.1f}  {ms:11.1f}  {plain_rate:13.1f}  {plain_ms:11.1f}")
        browser.close()


if __name__ == "__main__":
    main()
