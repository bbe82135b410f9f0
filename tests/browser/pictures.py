"""Makes the pictures of docs/view.md: python tests/browser/pictures.py [NAME ...]."""

from __future__ import annotations

import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from playwright.sync_api import Browser, sync_playwright
from served import Watched

from tussle import Block, Mission, Recorder, Simulation
from tussle.api import Autonomy, Output
from tussle.mission import read_mission
from tussle.stock import SingleIntegrator
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


class Hesitant(Autonomy):
    """The plugin of docs/view.md, with more places to think about."""

    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    def step(self, g):
        angle = np.linspace(0.0, 2.0 * np.pi, 32, endpoint=False)
        around = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle])
        circles = np.concatenate([radius * around for radius in (6.0, 12.0, 18.0)], axis=1)
        places = g.pos[:, :, None] + circles[:, None, :]
        cost = np.hypot(places[0] - 100.0, places[1])
        best = cost.argmin(axis=1)
        self.velocity[:] = 0.3 * circles[:, best]
        g.draw.cloud(pos=places.reshape(3, -1), value=cost.ravel(), size=2.0)
        g.draw.vectors(pos=g.pos, direction=2.0 * self.velocity, colour=(200, 0, 0))
        g.draw.sphere(pos=(100.0, 0.0, 0.0), radius=6.0, colour=(0, 150, 90), opacity=0.4)
        g.draw.text(pos=(100.0, 0.0, 10.0), text="goal")


def shapes(browser: Browser) -> None:
    """What a plugin thinks of the places around."""
    drones = Block(
        name="drone", team=2, count=5, position=(0, 0, 5), placement="uniform", half_width=(60, 60, 0), autonomy=Hesitant(),
        motion=SingleIntegrator(),
    )  # fmt: skip
    mission = Mission(blocks=[drones], end=60, name="Five drones on their way")
    camera = {"pos": "-70,-90,80", "focal_point": "45,5,5"}
    viewer = {
        "entities": {"drone": {"visual_model": "iris"}},
        "camera": camera,
        "grid_spacing": 10.0,
        "scale": 2.0,
    }
    with Simulation(mission, 1) as simulation, Live(simulation, is_paused=True, viewer=viewer) as live:
        page = Page(live, viewer=viewer)
        with shown(browser, page) as watched:
            watched.wait(lambda: live._sketchbook.is_open)
            live.step(30)
            watched.wait(lambda: watched.reads("step 30"))
            shoot(watched, "shapes")


PICTURES: dict[str, Callable[[Browser], None]] = {"chase": chase, "two-runs": two_runs, "shapes": shapes}


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
