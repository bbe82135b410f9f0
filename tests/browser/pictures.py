"""Makes the pictures of docs/view.md: python tests/browser/pictures.py [NAME ...]."""

from __future__ import annotations

import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from playwright.sync_api import Browser, sync_playwright
from served import Watched

from tussle import Recorder, Simulation
from tussle.mission import read_mission
from tussle.view import Live, Recording
from tussle.view.page.comparing import Comparison
from tussle.view.page.server import Page

IMAGES = Path(__file__).resolve().parents[2] / "docs" / "images"
SIZE = {"width": 900, "height": 480}
GAME = "predator_prey"


def shoot(watched: Watched, name: str) -> None:
    """Save the window as a picture, without what the browser says about itself."""
    for button in watched.tab.locator(".mantine-Notification-closeButton").all():
        button.click()
    watched.tab.wait_for_timeout(1500)
    watched.await_drawing()
    watched.tab.screenshot(path=IMAGES / f"view-{name}.png", timeout=300_000)


@contextmanager
def shown(browser: Browser, page: Page) -> Iterator[Watched]:
    with page:
        watched = Watched(browser, page, SIZE)
        yield watched
        watched.close()


def chase(browser: Browser) -> None:
    """Predators in the flock, seen from behind one of them."""
    loaded = read_mission(GAME)
    with (
        Simulation(loaded.mission, 1) as simulation,
        Live(simulation, is_paused=True, viewer=loaded.viewer) as live,
    ):
        page = Page(live, mission=loaded.mission, viewer=loaded.viewer)
        with shown(browser, page) as watched:
            live.step(480)
            live.settle(300.0)
            page.display.has_trails, page.display.model_scale = True, 0.6
            page.display.trail_time = 6.0
            page.display.version += 1
            watched.visitor.choose(int(live.frame().id[live.frame().team == 2][0]))
            watched.visitor.set_mode("behind")
            watched.wait(lambda: watched.reads("step 480"))
            shoot(watched, "chase")


def two_runs(browser: Browser) -> None:
    """The same game with one number changed."""
    folder = Path(tempfile.mkdtemp(prefix="runs"))
    for name, speed in (("a", "30"), ("b", "27")):
        loaded = read_mission(GAME, {"prey": "30", "prey.Boids.max_speed": speed})
        with Simulation(loaded.mission, 1) as game, Recorder(game, folder / name, mission_text=loaded.text):
            game.run(until=40.0)
    pair = Comparison(
        Recording(folder / "a"), Recording(folder / "b"), is_over_each_other=True, is_paused=True
    )
    page = Page(pair, mission=pair.mission, viewer=pair.viewer)
    with shown(browser, page) as watched:
        pair.seek(32.0)
        page.display.has_trails = True
        page.display.version += 1
        watched.visitor.choose(int(pair.frame().id[3]))
        watched.visitor.set_mode("follow")
        watched.visitor.zoom(is_nearer=False)
        watched.wait(lambda: watched.reads("t = 32.00 s"))
        shoot(watched, "two-runs")
    shutil.rmtree(folder)


PICTURES: dict[str, Callable[[Browser], None]] = {"chase": chase, "two-runs": two_runs}


def main() -> None:
    """Make those that are named, or all."""
    with sync_playwright() as playwright:
        options = ("--no-sandbox", "--enable-unsafe-swiftshader", "--use-angle=swiftshader")
        program = shutil.which("chromium")
        browser = playwright.chromium.launch(executable_path=program, args=list(options))
        for name in sys.argv[1:] or PICTURES:
            PICTURES[name](browser)
        browser.close()


if __name__ == "__main__":
    main()
