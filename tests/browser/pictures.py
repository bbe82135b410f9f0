"""Makes the pictures of docs/view.md and those of missions in the viewer: python tests/browser/pictures.py [NAME ...]."""

from __future__ import annotations

import io
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import matplotlib.image
import numpy as np
from playwright.sync_api import Browser, sync_playwright
from playwright.sync_api import Page as Tab
from served import Watched
from waiting import wait_until

from tussle import Block, Mission, Recorder, Simulation
from tussle.api import Autonomy, Output
from tussle.mission import read_mission
from tussle.stock import SingleIntegrator
from tussle.stress import Monitor, RecordedMonitor, Specification, Stress
from tussle.view import GroundMap, Live, Recording
from tussle.view.export.html import write_html
from tussle.view.page.access import PageRole
from tussle.view.page.compare import Comparison
from tussle.view.page.server import Page

IMAGES = Path(__file__).resolve().parents[2] / "docs" / "images"
SIZE = {"width": 1100, "height": 640}
NARROW = {"width": 400, "height": 780}
GAME = "predator_prey"


def shoot(watched: Watched, name: str) -> None:
    """Save the window as a picture."""
    watched.wait("player.isDrawn")
    watched.tab.wait_for_timeout(3500)  # until nothing is said any more
    save(watched.tab, name)


def save(tab: Tab, name: str) -> None:
    """Save what a tab shows, in 64 steps of each colour: the sky's grain, which hides its steps, would make the file large."""
    taken = matplotlib.image.imread(io.BytesIO(tab.screenshot(timeout=300_000)))[..., :3]
    levels = (255 * taken).round().astype(np.uint8)
    matplotlib.image.imsave(IMAGES / f"{name}.png", np.ascontiguousarray(levels & 0xFC | levels >> 6))


@contextmanager
def shown(browser: Browser, page: Page, size: dict[str, int] = SIZE) -> Iterator[Watched]:
    with page:
        watched = Watched(browser, page, size)
        yield watched
        watched.close()


@contextmanager
def hunted(browser: Browser) -> Iterator[Watched]:
    """The live page of a game in which predators are in the flock."""
    loaded = read_mission(GAME)
    with (
        Simulation(loaded.mission, 1) as simulation,
        Live(simulation, is_paused=True, viewer=loaded.viewer) as live,
        shown(browser, Page(live)) as watched,
    ):
        live.step(600)
        watched.wait("player.frame === 600")
        yield watched


def chase(browser: Browser) -> None:
    """Predators in the flock, live."""
    with hunted(browser) as watched:
        watched.press("ArrowRight")
        watched.press("o")
        watched.wait("player.status.entity")
        shoot(watched, "view-chase")


def plain(browser: Browser) -> None:
    """The same moment as a plain map."""
    with hunted(browser) as watched:
        watched.press("2")
        watched.wait("player.isPlain")
        shoot(watched, "view-plain")


def alarms(browser: Browser) -> None:
    """A specification that has failed, and one that was near failure."""
    loaded = read_mission(GAME)
    texts = "always (distance(team 1, team 1) > 2 m)", "always (count(team 1) > 95)"
    with Simulation(loaded.mission, 1) as simulation:
        monitors = [Monitor(Specification.parse(text, loaded.mission), simulation) for text in texts]
        live = Live(simulation, is_paused=True, viewer=loaded.viewer, specifications=monitors, margin=4.0)
        with live, shown(browser, Page(live), {"width": 1100, "height": 700}) as watched:
            live.step(900)
            watched.wait("player.frame === 900")
            shoot(watched, "view-alarms")


def recorded(folder: Path, *speeds: str, n: int = 30, seconds: float = 40.0) -> list[Recording]:
    """The same game with n prey of some speeds [m/s]."""
    runs = []
    for speed in speeds:
        loaded = read_mission(GAME, {"prey": str(n), "prey.Boids.max_speed": speed})
        with Simulation(loaded.mission, 1) as game, Recorder(game, folder / speed, mission_text=loaded.text):
            game.run(until=seconds)
        runs.append(Recording(folder / speed))
    return runs


def two_runs(browser: Browser) -> None:
    """The same game with one number changed, one over the other."""
    with tempfile.TemporaryDirectory() as folder:
        pair = Comparison(*recorded(Path(folder), "30", "27"), is_over_each_other=True)
        with shown(browser, Page(pair, is_paused=True)) as watched:
            seek(watched, 12.0)
            shoot(watched, "view-two-runs")


def why(browser: Browser) -> None:
    """The failing game of docs/stress.md beside the saved one, with robustness and moments."""
    example = Path(__file__).resolve().parents[2] / "examples" / "stress"
    spec, plugins = "always (distance(left, right) > 3 m)", [example / "hover.py"]
    given = {"run.end": 6, "left.Hover.gust": 4, "right.Hover.gust": 0}
    study = Stress(example / "pads.xml", spec, settings=given, plugin_files=plugins, ends_by_time=True)
    with tempfile.TemporaryDirectory() as folder:
        worst = study.sample(1000, directory=folder).failures[0]
        found = study.why(worst, directory=folder)
        runs = [
            Recording(Path(folder) / "failures" / name, plugin_files=tuple(plugins))
            for name in ("0", "0-saved")
        ]
        runs[0].mark(found.saved_step * study.mission.dt, "last moment at which it could be saved")
        runs[0].mark(found.lost_step * study.mission.dt, "lost from here on")
        for run in runs:
            run.watch([RecordedMonitor(spec, run)])
        with shown(browser, Page(Comparison(*runs), is_paused=True)) as watched:
            shoot(watched, "view-why")


def replay(browser: Browser) -> None:
    """A recorded run on a light page."""
    with tempfile.TemporaryDirectory() as folder:
        (run,) = recorded(Path(folder), "30")
        with shown(browser, Page(run, is_paused=True)) as watched:
            seek(watched, 25.0)
            watched.press("k")
            shoot(watched, "view-replay")


def narrow(browser: Browser) -> None:
    """A recorded run in a window of 400 pixels, with an entity that is followed."""
    with tempfile.TemporaryDirectory() as folder:
        (run,) = recorded(Path(folder), "30")
        with shown(browser, Page(run, is_paused=True), NARROW) as watched:
            seek(watched, 25.0)
            watched.press("ArrowLeft")
            watched.wait("player.chosen > 0 && player.isDrawn")
            watched.press("o")
            watched.press("k")
            shoot(watched, "view-narrow")


def dozers(browser: Browser) -> None:
    """The shipped mission dozers, from the side to which crates are pushed."""
    loaded = read_mission("dozers")
    camera = {"pos": "52,-34,30", "focal_point": "8,0,0"}
    with tempfile.TemporaryDirectory() as folder:
        with Simulation(loaded.mission, 1) as game, Recorder(game, folder, mission_text=loaded.text):
            game.run(until=26.0)
        with shown(
            browser, Page(Recording(folder), viewer={**loaded.viewer, "camera": camera}, is_paused=True)
        ) as watched:
            seek(watched, 26.0)
            shoot(watched, "mission-dozers")


def formation(browser: Browser) -> None:
    """A part of the shipped mission formation_flight, when all are in their places."""
    loaded = read_mission("formation_flight", {"leaders": "40", "wings": "360"})
    camera = {"pos": "1200,-1500,750", "focal_point": "2500,-350,330"}
    with tempfile.TemporaryDirectory() as folder:
        with (
            Simulation(loaded.mission, 1) as game,
            Recorder(game, folder, period=0.5, mission_text=loaded.text),
        ):
            game.run()
        with shown(
            browser, Page(Recording(folder), viewer={**loaded.viewer, "camera": camera}, is_paused=True)
        ) as watched:
            seek(watched, 115.0)
            shoot(watched, "mission-formation-flight")


def offline(browser: Browser) -> None:
    """The page in a file, opened from there."""
    with tempfile.TemporaryDirectory() as folder:
        (run,) = recorded(Path(folder), "30", n=100, seconds=70.0)
        path = Path(folder) / "page.html"
        write_html(run, path)
        tab = browser.new_page(viewport=SIZE, reduced_motion="reduce")
        tab.set_default_timeout(90_000)
        tab.goto(path.as_uri())
        wait_until(tab, "Boolean(window.player && player.isReady)", 90.0)
        tab.locator("#time").evaluate("(s) => { s.value = '58'; s.dispatchEvent(new Event('input')); }")
        for key in ("ArrowLeft", "o", "k"):
            tab.keyboard.press(key)
        wait_until(tab, "player.t === 58 && player.isDrawn", 90.0)
        tab.wait_for_timeout(3500)
        save(tab, "offline-page")
        tab.close()


def seek(watched: Watched, t: float) -> None:
    """Put the slider at a time [s]."""
    watched.tab.locator("#time").evaluate(
        "(s, t) => { s.value = String(t); s.dispatchEvent(new Event('input')); }", t
    )
    watched.wait(f"Math.abs(player.t - {t}) < 1e-6 && player.isDrawn")


def experiment(browser: Browser) -> None:
    """What Ada sees in the experiment with people, when two of her boats are on their way."""
    loaded = read_mission(IMAGES.parents[1] / "examples/experiment/buoys.xml")
    with (
        Simulation(loaded.mission, 1) as simulation,
        Live(simulation, is_paused=True, viewer=loaded.viewer) as live,
        Page(live, operators={"Ada": 1}) as page,
    ):
        for boat, x, y in ((1, -25.0, -45.0), (2, 40.0, -40.0)):
            live.order([boat], "LocalNetwork", "Waypoint", {"pos": [x, y, 0.0]})
        live.step(45)
        address = page.addresses[PageRole("operate", 1, "Ada")]
        watched = Watched(browser, page, {"width": 1100, "height": 800}, address)
        watched.wait("player.frame === 45")
        for key in ("Escape", "ArrowRight", "ArrowRight", "ArrowRight", "o"):
            watched.press(key)
        watched.wait("player.status.entity && player.chosen === 3")
        for part, value in zip("xyz", ("5", "-45", "0"), strict=True):
            watched.tab.get_by_label(f"pos {part}", exact=True).fill(value)
        shoot(watched, "experiment")
        watched.close()


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
    with (
        Simulation(mission, 1) as simulation,
        Live(simulation, is_paused=True, viewer=viewer) as live,
        shown(browser, Page(live)) as watched,
    ):
        watched.until(lambda: live._collector.is_open)
        live.step(30)
        watched.wait("player.frame === 30 && player.shapes.length > 1")
        shoot(watched, "view-shapes")


def texture(browser: Browser) -> None:
    """Robots among boxes, on hills with an image over them."""
    with tempfile.TemporaryDirectory() as folder:
        side = np.linspace(0.0, 1.0, 121)
        x, y = np.meshgrid(side, side)
        height = 0.45 + 0.22 * np.sin(7.0 * x + 1.0) * np.cos(5.0 * y) + 0.18 * np.sin(11.0 * y - 3.0 * x)
        fields = 0.5 + 0.5 * np.sign(np.sin(24.0 * x + 6.0 * y) * np.sin(18.0 * y))
        colours = np.array([(0.35, 0.47, 0.22), (0.62, 0.57, 0.30)])
        image = colours[fields.astype(int)] + 0.25 * (height - 0.45)[..., None]
        image[np.abs(y - 0.5 - 0.12 * np.sin(6.0 * x)) < 0.02] = (0.72, 0.70, 0.66)  # a road
        image[height < 0.22] = (0.25, 0.42, 0.58)
        matplotlib.image.imsave(f"{folder}/hills.png", height, cmap="gray", vmin=0.0, vmax=1.0)
        matplotlib.image.imsave(f"{folder}/photo.png", np.clip(image, 0.0, 1.0))
        Path(folder, "hills.xml").write_text(HILLS)
        loaded = read_mission(Path(folder, "hills.xml"))
        live = Live(Simulation(loaded.mission, 3), viewer=loaded.viewer, is_paused=True)
        with live, shown(browser, Page(live, viewer=loaded.viewer)) as watched:
            shoot(watched, "view-texture")


def on_map(browser: Browser) -> None:
    """Robots above fields, a road and a river, with a flag and the place to which it is brought."""
    with tempfile.TemporaryDirectory() as folder:
        y, x = np.mgrid[1.0:0.0:800j, 0.0:1.0:1000j]
        shade = np.random.default_rng(4).random((9, 12))[(y * 8.999).astype(int), (x * 11.999).astype(int)]
        image = np.stack([0.33 + 0.25 * shade, 0.46 + 0.12 * shade, 0.24 + 0.1 * shade], axis=-1)
        image[np.minimum((12.0 * x) % 1.0, (9.0 * y) % 1.0) < 0.05] *= 0.8
        image[np.abs(y - 0.62 - 0.08 * np.sin(7.0 * x)) < 0.018] = (0.30, 0.45, 0.60)
        image[np.abs(x - 0.48 - 0.2 * (y - 0.5)) < 0.006] = (0.80, 0.79, 0.75)
        matplotlib.image.imsave(f"{folder}/photo.png", np.clip(image, 0.0, 1.0))
        Path(folder, "field.xml").write_text(FIELD)
        loaded = read_mission(Path(folder, "field.xml"))
        ground_map = GroundMap(Path(folder, "photo.png"), (13.2925, 52.1960, 13.3075, 52.2040))
        live = Live(
            Simulation(loaded.mission, 3), viewer=loaded.viewer, is_paused=True, ground_map=ground_map
        )
        with live, shown(browser, Page(live, viewer=loaded.viewer)) as watched:
            live.step(60)
            watched.wait("player.frame === 60")
            watched.choose(5)
            watched.tab.mouse.move(560, 330)
            shoot(watched, "view-map")


FIELD = """<runscript name="A flag on a field"><run dt="0.1" end="60"/>
<latitude_origin>52.2</latitude_origin><longitude_origin>13.3</longitude_origin><altitude_origin>40</altitude_origin>
<ground>0</ground><show_origin>false</show_origin>
<entity_interaction name="flag" id="1" team_id="1" type="sphere" center="130 60 0" radius="20">Boundary</entity_interaction>
<entity_interaction id="2" team_id="2" type="sphere" center="-160 -40 0" radius="25">Boundary</entity_interaction>
<entity_interaction flag_boundary_id="1" capture_boundary_id="2">FlagCaptureInteraction</entity_interaction>
<entity><name>guard</name><team_id>1</team_id><count>4</count><x>110</x><y>40</y><z>10</z><visual_model>iris</visual_model><visual_scale>6</visual_scale>
  <placement>uniform</placement><half_width_x>40</half_width_x><half_width_y>40</half_width_y><motion_model>Still</motion_model></entity>
<entity><name>runner</name><team_id>2</team_id><count>6</count><x>-150</x><y>-30</y><z>10</z><visual_model>iris</visual_model><visual_scale>6</visual_scale>
  <placement>uniform</placement><half_width_x>60</half_width_x><half_width_y>60</half_width_y>
  <autonomy>TakeFlag</autonomy><motion_model max_speed="15">SingleIntegrator</motion_model></entity>
</runscript>
"""


HILLS = """<runscript name="Crates on hills"><run dt="0.1" end="60"/>
<terrain cell="1.5" height="30" texture="photo.png">hills.png</terrain><show_origin>false</show_origin>
<camera pos="90, -70, 95" focal_point="90, 85, 10"/>
<entity><name>crate</name><team_id>2</team_id><count>14</count><x>90</x><y>85</y><z>24</z><color>190 120 60</color>
  <box_x>10</box_x><box_y>6</box_y><box_z>14</box_z><heading_variance>3</heading_variance>
  <placement>uniform</placement><half_width_x>70</half_width_x><half_width_y>70</half_width_y><motion_model>Still</motion_model></entity>
<entity><name>drone</name><team_id>1</team_id><count>6</count><x>90</x><y>85</y><z>38</z><visual_model>iris</visual_model><visual_scale>5</visual_scale>
  <placement>uniform</placement><half_width_x>60</half_width_x><half_width_y>60</half_width_y><motion_model>Still</motion_model></entity>
</runscript>
"""

PICTURES: dict[str, Callable[[Browser], None]] = {
    "chase": chase,
    "plain": plain,
    "alarms": alarms,
    "experiment": experiment,
    "two-runs": two_runs,
    "why": why,
    "replay": replay,
    "narrow": narrow,
    "dozers": dozers,
    "formation": formation,
    "offline": offline,
    "shapes": shapes,
    "texture": texture,
    "map": on_map,
}


def main() -> None:
    """Make those that are named, or all."""
    with sync_playwright() as playwright:
        options = ("--no-sandbox", "--enable-unsafe-swiftshader", "--use-angle=swiftshader")
        program = shutil.which("chromium") or shutil.which("chromium-headless-shell")
        browser = playwright.chromium.launch(executable_path=program, args=list(options))
        for name in sys.argv[1:] or PICTURES:
            PICTURES[name](browser)
        browser.close()


if __name__ == "__main__":
    main()
