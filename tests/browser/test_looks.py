"""How the page of a game looks in windows of several sizes: nothing lies over anything else, and all can be read."""

from __future__ import annotations

import io
import re

import matplotlib.image
import pytest
from contrast import faint_texts
from recorded_games import hunt, record
from served import Watched

from tussle import Block, Mission, Simulation
from tussle.batch import Batch, load_batch
from tussle.batch.report import write_report
from tussle.stock import FieldOfView, SimpleCar, SimpleCarControllerHeading, Straight
from tussle.view import Live, Recording
from tussle.view.page.server import Page

SIZES = [(1600, 900), (1280, 640), (800, 900), (390, 844)]
BOX = "(id) => { const b = document.getElementById(id).getBoundingClientRect(); return [b.left, b.top, b.right, b.bottom]; }"


def watched_mission():
    """A game whose names are long, with sensors."""
    mission = hunt(n_prey=20, end=30.0, end_conditions="time")
    prey, late, hunters = mission.blocks
    eyes = FieldOfView(azimuth_fov=2.0943951023931953, max_range=150.0)
    return mission.replace(
        blocks=[prey.replace(name="prey_of_the_north"), late, hunters.replace(sensor=[eyes])]
    )


@pytest.fixture(scope="module")
def game(chromium):
    """A game in its midst, and a browser that shows it."""
    with (
        Simulation(watched_mission(), 3) as simulation,
        Live(simulation, is_paused=True, pace=1.0) as live,
        Page(live) as page,
    ):
        live.step(60)
        watched = Watched(chromium, page)
        watched.wait("player.frame === 60")
        yield live, watched
        watched.close()
        assert not watched.trouble, "\n".join(watched.trouble)


def resized(watched, size):
    """Give the window a size, choose nobody, close all."""
    watched.tab.set_viewport_size({"width": size[0], "height": size[1]})
    watched.press("r")
    watched.wait(f"innerWidth === {size[0]} && player.isDrawn && player.mode === 'overview'")


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("is_chosen", [False, True])
def test_no_entity_lies_under_a_panel_in_the_overview(game, size, is_chosen):
    _, watched = game
    resized(watched, size)
    if is_chosen:
        watched.press("ArrowRight")
        watched.press("o")
        watched.wait("player.status.entity && player.isDrawn && player.mode === 'overview'")
    watched.until(lambda: not covered(watched, size[0]))  # the view follows panels that have grown
    assert watched.tab.evaluate(BOX, "ticker")[3] <= watched.tab.evaluate(BOX, "bar")[1]


def covered(watched, width):
    """Entities that lie under a panel or beside the window."""
    panels = [watched.tab.evaluate(BOX, name) for name in ("head", "right", "bar")]
    return [
        who
        for who, x, y in watched.tab.evaluate("() => player.ids.map((id) => [id, ...player.pixelOf(id)])")
        if not 0 <= x <= width
        or any(left < x < right and top < y < bottom for left, top, right, bottom in panels)
    ]


@pytest.mark.parametrize("size", SIZES)
def test_nothing_is_wider_than_the_panel_around_it(game, size):
    _, watched = game
    resized(watched, size)
    for key in ("ArrowRight", "d"):
        watched.press(key)
    watched.wait("player.status.entity && player.isDrawn")
    outside = watched.tab.evaluate(
        """() => [...document.querySelectorAll('.card')].flatMap((card) => {
          const box = card.getBoundingClientRect();
          return [...card.querySelectorAll('*')].filter((node) => {
            const { left, right, width } = node.getBoundingClientRect();
            const isScrolled = node.closest('#teams, #scores') && innerWidth <= 720;
            return width && !isScrolled && node.checkVisibility() && (left < box.left - 0.5 || right > box.right + 0.5);
          }).map((node) => `${card.id}: ${node.tagName} ${node.textContent.slice(0, 30)}`);
        })"""
    )
    left, top, right, bottom = watched.tab.evaluate(BOX, "settings")
    watched.press("d")
    assert not outside
    assert min(left, top) >= 0
    assert right <= size[0]
    assert bottom <= size[1]


@pytest.mark.parametrize("size", SIZES)
def test_the_inspector_is_in_the_window_and_can_be_read_to_its_end(game, size):
    _, watched = game
    resized(watched, size)
    watched.press("ArrowRight")
    watched.wait(
        "player.status.entity && player.isDrawn && document.querySelectorAll('#sections section').length"
    )
    chosen = watched.tab.evaluate(BOX, "chosen")
    assert chosen[3] <= watched.tab.evaluate(BOX, "bar")[1] + 1
    assert chosen[3] - chosen[1] > 180
    watched.tab.locator("#sections section").last.locator("dd").last.scroll_into_view_if_needed()
    last = watched.tab.locator("#sections section").last.locator("dd").last.bounding_box()
    assert chosen[1] <= last["y"] <= chosen[3] - last["height"]
    buttons = watched.tab.locator(".modes").bounding_box()
    assert buttons["y"] + buttons["height"] <= chosen[3] + 1


@pytest.mark.parametrize("size", SIZES)
def test_scores_and_teams_are_there_by_name(game, size):
    _, watched = game
    resized(watched, size)
    watched.wait("document.querySelector('#scores .score:not([hidden])')")
    scores = watched.tab.locator("#scores")
    assert scores.is_visible()
    assert "hunters" in scores.locator(".score:visible").last.inner_text()
    assert watched.tab.locator("#teams .team span").first.inner_text().startswith("prey_of_the_north")
    assert "prey_of_the_north, late 0" in watched.tab.locator("#metrics").inner_text()
    watched.press("ArrowRight")
    assert watched.tab.locator("#chosen dd").first.inner_text() == "prey_of_the_north, late"


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_all_texts_can_be_read(game, theme):
    _, watched = game
    resized(watched, SIZES[0])
    while watched.tab.evaluate("() => player.drawn.theme") != theme:
        watched.press("k")
    watched.press("ArrowRight")
    for key in ("d", "h", "i"):
        watched.press(key)
        watched.wait("player.status.entity && player.isDrawn")
        behind = watched.tab.evaluate(
            "() => ['--sky', '--ground'].map((name) => getComputedStyle(document.body).getPropertyValue(name).trim())"
        )
        colours = [[int(each[i : i + 2], 16) for i in (1, 3, 5)] for each in behind]
        faint = faint_texts(watched.tab, colours)
        watched.tab.keyboard.press("Escape")
        assert not faint


def test_escape_and_space_close_a_dialog_and_play(game):
    live, watched = game
    resized(watched, SIZES[2])
    for name in ("h", "i"):
        watched.press(name)
        watched.tab.locator("dialog[open] button").focus()
        watched.tab.keyboard.down(" ")
        watched.tab.keyboard.down("Escape")
        watched.tab.keyboard.up("Escape")
        watched.tab.keyboard.up(" ")
        assert watched.tab.locator("dialog[open]").count() == 0
        watched.press(name)
        watched.tab.evaluate("() => document.querySelector('dialog[open]').close()")
        watched.tab.evaluate("() => document.querySelector('dialog [data-do=close]').click()")
    assert live.is_paused


def test_the_settings_name_the_fields_of_view_of_the_sensors(game):
    _, watched = game
    resized(watched, SIZES[2])
    watched.press("d")
    settings = watched.tab.locator("#settings")
    assert settings.locator("#views").inner_text() == "hunters, FieldOfView: 120° × 60°, 150 m"
    assert not settings.locator("#coneAngle").is_visible()
    before = watched.tab.screenshot()
    settings.get_by_label("Fields of view").check()
    watched.wait("player.isDrawn && player.drawn.cones")
    assert watched.tab.screenshot() != before
    settings.get_by_label("Fields of view").uncheck()
    watched.press("d")


def test_about_says_what_is_played(game):
    _, watched = game
    watched.press("i")
    facts = watched.tab.locator("#info dl")
    said = dict(
        zip(facts.locator("dt").all_inner_texts(), facts.locator("dd").all_inner_texts(), strict=True)
    )
    watched.tab.keyboard.press("Escape")
    assert (said["Seed"], said["Step"], said["End"]) == ("3", "0.1 s", "30 s")
    assert said["Team 2"] == "hunters: 3 entities"
    assert said["Plugins of hunters"] == "Predator, Unicycle, FieldOfView"
    assert "SimpleCapture" in said["Plugins of the world"]


def test_the_time_line_reaches_to_the_end_of_the_mission(game):
    live, watched = game
    live.seek(6.0)
    watched.wait("player.t === 6 && player.isDrawn")
    assert watched.tab.locator("#time").evaluate(
        "(s) => [Number(s.min), Number(s.max), Number(s.value)]"
    ) == [0, 30, 6]
    assert re.sub(r"\s+", " ", watched.tab.locator("#clock").inner_text()) == "6.0 / 30.0 s"


def test_between_the_states_of_a_live_game_entities_are_on_the_way(game):
    live, watched = game
    resized(
        watched, (240, 200)
    )  # a small picture, as without a graphics card only few large ones are drawn in a second
    live.warp = 0.25
    live.resume()
    seen = watched.tab.evaluate(
        """() => new Promise((done) => {
          const times = new Set();
          const began = performance.now();
          const nBetween = () => [...times].filter((t) => Math.abs(10 * t - Math.round(10 * t)) > 1e-3).length;
          const look = () => {
            times.add(player.t);
            if (nBetween() > 12 || performance.now() - began > 20000) done([...times]);
            else requestAnimationFrame(look);
          };
          look();
        })"""
    )
    live.pause()
    live.settle()
    watched.wait(f"player.frame === {live.step_number} && player.isDrawn")
    steps = [t / 0.1 for t in seen]
    between = [step for step in steps if abs(step - round(step)) > 1e-3]
    assert len(between) > 3, "states are not whole steps only"
    assert seen == sorted(seen), "and the game does not go back"


def crowd(n):
    """Cars of two teams, one in the west and one in the east."""
    blocks = [
        Block(
            name=f"cars_{team}",
            team=team,
            count=n // 2,
            position=(x, 0.0, 0.0),
            placement="uniform",
            half_width=(140.0, 100.0, 0.0),
            scatter_first=True,
            autonomy=[Straight(speed=0.0)],
            controller=[SimpleCarControllerHeading()],
            motion=SimpleCar(),
        )
        for team, x in ((1, -160.0), (2, 160.0))
    ]
    return Mission(blocks=blocks, dt=0.1, end=1e4)


@pytest.mark.parametrize("n", [400, 800])
def test_entities_of_a_crowd_stand_where_they_are_in_their_colours(chromium, n):
    """The corners of 800 cars are more than all are drawn for where they are small."""
    with (
        Simulation(crowd(n), 1) as simulation,
        Live(simulation, is_paused=True, pace=1.0) as live,
        Page(live) as page,
    ):
        watched = Watched(chromium, page, {"width": 1100, "height": 700})
        watched.press("v")
        watched.wait("player.isDrawn && player.camera.pitch > 1.5")
        picture = matplotlib.image.imread(io.BytesIO(watched.tab.screenshot()))
        places = "(ids) => ids.map((id) => [id, player.stateOf(id).pos[0], ...player.pixelOf(id)])"
        for who, east, x, y in watched.tab.evaluate(places, [*range(1, n + 1, 17)]):
            red, _, blue = picture[round(y), round(x), :3]
            assert (blue > red + 0.2) if east < 0.0 else (red > blue + 0.2), who
        widths = "() => ['view', 'over'].map((id) => document.getElementById(id).width)"
        assert watched.tab.evaluate(widths) == [1100, 1100]
        live.resume()
        watched.until(lambda: watched.tab.evaluate(widths) == [550, 1100])
        live.pause()
        watched.until(lambda: watched.tab.evaluate(widths) == [1100, 1100])
        watched.close()
        assert not watched.trouble


def test_a_report_can_be_read(chromium, tmp_path):
    Batch(hunt(), runs=4).play(tmp_path / "batch")
    index = write_report(load_batch(tmp_path / "batch"), tmp_path / "report").index
    tab = chromium.new_page(viewport={"width": 800, "height": 900})
    tab.goto(index.as_uri())
    for scheme, behind in (("light", 255), ("dark", 0)):
        tab.emulate_media(color_scheme=scheme)
        assert not faint_texts(tab, [[behind] * 3]), scheme
    tab.close()


def test_a_recording_says_the_same_of_its_mission(chromium, tmp_path):
    run = Recording(record(watched_mission(), tmp_path / "run"))
    with Page(run, is_paused=True) as page:
        watched = Watched(chromium, page)
        facts = watched.tab.locator("#info dl")
        names = facts.evaluate("(list) => [...list.querySelectorAll('dt')].map((node) => node.textContent)")
        watched.close()
    assert {"Mission", "Step", "End", "Seed", "Team 1", "Plugins of late"} <= set(names)
