"""The offline page, opened from a file in a real browser, plays what was recorded."""

from __future__ import annotations

import math
from dataclasses import replace

import matplotlib.image
import numpy as np
import pytest
from recorded_games import hunt, record
from waiting import wait_until

from tussle import Block, Mission
from tussle.mission import read_mission
from tussle.stock import Still
from tussle.view import Recording
from tussle.view.export.html import write_html
from tussle.view.solids import Terrain

READY = "Boolean(window.player && player.isReady)"


@pytest.fixture(scope="session")
def hunted(tmp_path_factory):
    """A run with births, captures and deaths, and its page in pieces of a few frames."""
    folder = tmp_path_factory.mktemp("hunted")
    recording = Recording(record(hunt(n_prey=8, end=20.0), folder / "run"))
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("tussle.view.page.recorded.FILE_STATES", 1)
        export = write_html(recording, folder / "page.html")
    return recording, export


@pytest.fixture
def new_page(watched, hunted):
    """The page, ready, and nothing moving on it: for tests that change its settings."""
    return opened(watched, hunted[1].path)


@pytest.fixture(scope="module")
def kept_page(watched_by_module, hunted):
    return opened(watched_by_module, hunted[1].path)


@pytest.fixture
def page(kept_page):
    """The page of the tests before, as at its beginning: for tests that change the time, the view and who is chosen."""
    if kept_page.evaluate("() => player.isPlaying"):
        kept_page.keyboard.press("Space")
    for key in ("Escape", "Home", "r", "o"):
        kept_page.keyboard.press(key)
    beginning = "player.t === 0 && !player.isPlaying && player.chosen === 0 && player.mode === 'overview'"
    wait_until(kept_page, f"{beginning} && player.isDrawn")
    return kept_page


def opened(watched, path, **options):
    page = watched(path.as_uri(), reduced_motion="reduce", **options)
    page.goto(path.as_uri())
    wait_until(page, READY)
    wait_until(page, "player.isDrawn")
    return page


def seek(page, t):
    """Put the slider at a time, as a hand does."""
    page.locator("#time").evaluate(
        "(s, t) => { s.value = String(t); s.dispatchEvent(new Event('input')); }", t
    )
    wait_until(page, f"Math.abs(player.t - {t}) < 1e-6 && player.isDrawn")


# -- time -----------------------------------------------------------------------------------------------------------------------------


def test_the_clock_goes_while_it_plays_and_stands_when_it_is_paused(page):
    assert page.evaluate("() => player.t") == 0.0
    page.get_by_role("button", name="Play", exact=True).click()
    wait_until(page, "player.t > 0.3")
    assert page.get_by_role("button", name="Pause", exact=True).is_visible()
    page.get_by_role("button", name="Pause", exact=True).click()
    t = page.evaluate("() => player.t")
    page.wait_for_timeout(400)
    assert page.evaluate("() => player.t") == t
    wait_until(page, "player.isDrawn")
    assert page.locator("#clock b").inner_text() == page.evaluate("() => player.t.toFixed(1)")


def test_the_clock_goes_as_fast_as_is_said(page):
    for _ in range(2):
        page.keyboard.press("[")
    assert page.evaluate("() => player.speed") == 0.2
    page.keyboard.press("]")
    wait_until(page, "player.isDrawn")
    assert page.locator("#speed").inner_text() == "0.5×"
    shown, passed = page.evaluate(
        """async () => {
            const nextFrame = () => new Promise(requestAnimationFrame);
            document.getElementById('play').click();
            let frame = await nextFrame(), passed = 0;
            const begin = player.t;
            for (let n = 0; n < 8 || player.t === begin; n++) {
                const next = await nextFrame();
                passed += Math.min((next - frame) / 1000, 1);  // longer frames are not made up for
                frame = next;
            }
            return [player.t - begin, passed];
        }"""
    )
    assert 0.25 * passed < shown < 0.75 * passed + 0.05
    page.keyboard.press("]")
    wait_until(page, "player.speed === 1")


def test_a_step_goes_one_frame_on_or_back(page, hunted):
    t = hunted[0].t.tolist()
    for key, frame in ((".", 1), (".", 2), (",", 1), (",", 0), (",", 0)):
        page.keyboard.press(key)
        wait_until(page, f"player.frame === {frame} && player.t === {t[frame]!r}")
    seek(page, 0.25)
    page.keyboard.press(",")
    wait_until(page, f"player.t === {t[2]!r}")
    page.keyboard.press("End")
    page.keyboard.press(".")
    wait_until(page, f"player.t === {t[-1]!r} && player.frame === {len(t) - 1}")
    page.keyboard.press("Home")
    wait_until(page, "player.t === 0")


def test_playing_ends_at_the_end_and_begins_again_at_the_beginning(page, hunted):
    end = float(hunted[0].t[-1])
    seek(page, end - 0.2)
    page.keyboard.press("Space")
    wait_until(page, f"player.t === {end!r} && !player.isPlaying")
    page.keyboard.press("Space")
    wait_until(page, f"player.isPlaying && player.t < {end - 1.0}")


def test_the_slider_goes_with_the_time_and_the_time_with_the_slider(page, hunted):
    slider, end = page.locator("#time"), float(hunted[0].t[-1])
    box = slider.bounding_box()
    page.mouse.click(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])
    wait_until(page, f"Math.abs(player.t - {0.5 * end}) < {0.02 * end} && player.isDrawn")
    page.keyboard.press("Home")
    wait_until(page, "document.getElementById('time').value === '0'")


def test_what_is_shown_at_any_time_is_what_was_recorded(page, hunted):
    """All frames of the browser's own decoder, through all pieces, forth and then back."""
    recording, export = hunted
    assert page.evaluate("() => player.nFrames") == recording.n_frames
    for i in [*range(0, recording.n_frames, 19), recording.n_frames - 1, 40, 3]:
        frame = recording.frame(i)
        seek(page, float(recording.t[i]))
        assert sorted(page.evaluate("() => player.ids")) == frame.id.tolist()
        states = page.evaluate("(ids) => ids.map((id) => player.stateOf(id))", frame.id.tolist())
        for row, state in enumerate(states):
            assert math.dist(state["pos"], frame.pos[row]) <= export.position_error + 1e-11
            # The browser keeps attitudes in 32 bits.
            assert abs(np.dot(state["quat"], frame.quat[row])) > math.cos(0.5 * export.angle_error) - 1e-6


def test_between_frames_it_goes_the_straight_way(page, hunted):
    recording = hunted[0]
    seek(page, float(0.25 * recording.t[10] + 0.75 * recording.t[11]))
    one, two = recording.frame(10), recording.frame(11)
    for who in page.evaluate("() => player.ids"):
        expected = 0.25 * one.pos[one.row_of(who)] + 0.75 * two.pos[two.row_of(who)]
        assert math.dist(page.evaluate("(id) => player.stateOf(id).pos", who), expected) < 0.005


# -- what happens -----------------------------------------------------------------------------------------------------------------------


def test_a_mark_tells_what_happened_and_jumps_there(page, hunted):
    marks = page.evaluate("() => player.events")
    assert not [m for m in marks if m["kind"] == "birth" and m["t"] == 0.0]
    captures = [m for m in marks if m["kind"] == "capture"]
    assert captures
    # A capture tells of the death as well.
    assert not [m for m in marks if m["kind"] == "death" and m["id"] in {c["other"] for c in captures}]
    capture, box = captures[0], page.locator("#events").bounding_box()
    share = capture["t"] / hunted[0].t[-1]
    x, y = box["x"] + 7.5 + share * (box["width"] - 15), box["y"] + 12
    page.mouse.move(x, y)
    words = f"hunters {capture['id']} captured prey {capture['other']}"
    assert words in page.locator("#tip").inner_text()
    page.mouse.click(x, y)
    near = [m["t"] for m in marks if abs(m["t"] - capture["t"]) < 1.0]
    wait_until(page, f"{near}.includes(player.t)")
    assert "captured" in page.locator("#said").inner_text()


def test_keys_go_from_one_happening_to_the_next(page):
    times = sorted({m["t"] for m in page.evaluate("() => player.events")} - {0.0})
    for t in times[:3]:
        page.keyboard.press("PageDown")
        wait_until(page, f"player.t === {t!r}")
    page.keyboard.press("PageUp")
    wait_until(page, f"player.t === {times[1]!r}")
    wait_until(page, "player.isDrawn")
    assert page.locator("#ticker li").count() >= 1


def test_teams_are_counted_as_they_are(page, hunted):
    recording = hunted[0]
    for i in (0, 30, recording.n_frames - 1):
        seek(page, float(recording.t[i]))
        frame = recording.frame(i)
        shown = page.locator("#teams .team b").all_inner_texts()
        assert [int(n) for n in shown] == [int((frame.team == team).sum()) for team in recording.teams]


# -- choosing and looking ---------------------------------------------------------------------------------------------------------------


def test_a_click_chooses_and_a_second_one_follows(page, hunted):
    x, y = page.evaluate("() => player.pixelOf(player.ids[0])")
    page.mouse.click(x, y)
    wait_until(page, "player.chosen > 0 && player.isDrawn")
    who = page.evaluate("() => player.chosen")
    assert math.dist(page.evaluate("(id) => player.pixelOf(id)", who), (x, y)) < 12
    assert page.locator("#chosen h2").inner_text().endswith(f" {who}")
    assert page.evaluate("() => player.mode") == "overview"
    page.mouse.click(x, y)
    wait_until(page, "player.mode === 'follow'")
    wait_until(
        page, f"Math.hypot(...player.camera.target.map((c, k) => c - player.stateOf({who}).pos[k])) < 0.01"
    )
    before = page.evaluate("() => player.camera.target")
    seek(page, 2.0)
    after = page.evaluate("() => player.camera.target")
    frame = hunted[0].at(2.0)
    assert math.dist(after, frame.pos[frame.row_of(who)]) < 0.01
    assert math.dist(before, after) > 10.0
    page.keyboard.press("Escape")
    wait_until(page, "player.chosen === 0 && player.mode === 'free'")


def test_a_click_on_nothing_lets_go(page):
    page.mouse.click(*page.evaluate("() => player.pixelOf(player.ids[0])"))
    wait_until(page, "player.chosen > 0 && player.isDrawn")
    assert page.locator("#chosen").is_visible()
    pixels = page.evaluate("() => player.ids.map((id) => player.pixelOf(id))")
    empty = next((x, 300) for x in range(30, 600, 10) if all(math.dist(p, (x, 300)) > 40 for p in pixels))
    page.mouse.click(*empty)
    wait_until(page, "player.chosen === 0 && player.isDrawn")
    assert page.locator("#chosen").is_hidden()


def test_keys_follow_the_next_and_the_one_before_in_three_ways(page):
    page.keyboard.press("ArrowRight")
    wait_until(page, "player.chosen === 1 && player.mode === 'follow'")
    page.keyboard.press("ArrowRight")
    wait_until(page, "player.chosen === 2")
    page.keyboard.press("ArrowLeft")
    page.keyboard.press("ArrowLeft")
    wait_until(page, "player.chosen === Math.max(...player.ids)")
    for mode in ("behind", "free", "follow", "behind"):
        page.keyboard.press("a")
        wait_until(page, f"player.mode === '{mode}'")
    nose = "2 * Math.atan2(q[3], q[0])"
    wait_until(
        page,
        f"(() => {{ const q = player.stateOf(player.chosen).quat; const gap = player.camera.yaw - {nose} - Math.PI;"
        " return Math.abs(Math.sin(gap / 2)) < 0.02; })()",
    )


def test_dragging_turns_the_view_and_undo_turns_it_back(page):
    before = page.evaluate("() => player.camera")
    page.mouse.move(450, 200)
    page.mouse.down()
    page.mouse.move(520, 230, steps=4)
    page.mouse.up()
    wait_until(page, f"Math.abs(player.camera.yaw - {before['yaw']}) > 0.2")
    assert page.evaluate("() => player.chosen") == 0
    page.keyboard.press("u")
    wait_until(page, f"Math.abs(player.camera.yaw - {before['yaw']}) < 1e-3")


def test_wheel_and_keys_come_nearer_and_the_overview_comes_back(page):
    distance = page.evaluate("() => player.camera.distance")
    page.mouse.move(450, 300)
    page.mouse.wheel(0, -400)
    wait_until(page, f"player.camera.distance < {0.8 * distance} && player.mode === 'free'")
    page.keyboard.press("Shift+Z")
    page.keyboard.press("o")
    wait_until(
        page,
        f"player.mode === 'overview' && Math.abs(player.camera.distance - {distance}) < 0.01 * {distance}",
    )
    page.keyboard.press("v")
    wait_until(page, "player.camera.pitch > 1.57")
    page.keyboard.press("r")
    wait_until(
        page, f"player.camera.pitch < 1 && Math.abs(player.camera.distance - {distance}) < 0.01 * {distance}"
    )


def test_the_overview_has_everybody_in_view(page, hunted):
    for t in (0.0, 15.0):
        seek(page, t)
        for x, y in page.evaluate("() => player.ids.map((id) => player.pixelOf(id))"):
            assert 0 < x < 900
            assert 0 < y < 650


def picture(page):
    """What is drawn, as it is saved by the page, (height, width, 3)."""
    with page.expect_download() as download:
        page.keyboard.press("c")
    return matplotlib.image.imread(download.value.path(), "png")[..., :3]


def n_blue_and_vermilion(page):
    """How many pixels have the colours of prey and of hunters."""
    red, green, blue = picture(page).reshape(-1, 3).T
    return int(((blue - red > 0.35) & (blue > green)).sum()), int(((red - blue > 0.35) & (red > green)).sum())


def test_entities_are_drawn_in_the_colours_of_their_teams(new_page, hunted):
    happened = [m["t"] for m in new_page.evaluate("() => player.events")]
    # What happens flashes for a second, in a colour that is like the hunters'.
    seek(new_page, next(t for t in hunted[0].t.tolist() if all(not t - 1.0 < h <= t for h in happened)))
    if new_page.evaluate("() => player.drawn.labels"):
        new_page.keyboard.press("l")
    new_page.locator("#trail").evaluate("(s) => { s.value = '0'; s.dispatchEvent(new Event('input')); }")
    new_page.keyboard.press("g")
    prey, hunters = n_blue_and_vermilion(new_page)
    assert prey > 100
    assert hunters > 50
    for _ in range(6):
        new_page.keyboard.press("+")
    new_page.keyboard.press("w")
    assert n_blue_and_vermilion(new_page) != (prey, hunters)
    new_page.keyboard.press("s")
    assert n_blue_and_vermilion(new_page)[0] > 2 * prey
    new_page.keyboard.press("0")
    assert n_blue_and_vermilion(new_page) == (prey, hunters)
    new_page.locator("#teams .team").last.click()
    assert n_blue_and_vermilion(new_page)[1] == 0


def test_the_saved_picture_has_the_name_of_the_game_and_the_time(page):
    seek(page, 2.5)
    with page.expect_download() as download:
        page.get_by_role("button", name="Save the picture").click()
    assert download.value.suggested_filename == "hunt-2.5s.png"
    assert matplotlib.image.imread(download.value.path(), "png").shape[:2] == (650, 900)


def test_a_team_can_be_hidden(new_page):
    new_page.locator("#teams .team").first.click()
    wait_until(new_page, "player.drawn.hidden.length === 1")
    new_page.keyboard.press("ArrowRight")
    wait_until(new_page, "player.chosen > 0 && player.isDrawn")
    assert new_page.locator("#chosen dd").first.inner_text() == "hunters"


def test_settings_and_keys_say_the_same(new_page):
    new_page.keyboard.press("d")
    assert new_page.locator("#settings").is_visible()
    new_page.keyboard.press("l")
    is_on = new_page.evaluate("() => player.drawn.labels")
    assert new_page.locator("#labels").is_checked() is is_on
    new_page.locator("#trail").evaluate("(s) => { s.value = '7'; s.dispatchEvent(new Event('input')); }")
    wait_until(new_page, "player.drawn.trail === 7")
    assert new_page.locator("#trail-says").inner_text() == "all"
    new_page.keyboard.press("k")
    wait_until(new_page, "player.drawn.theme === 'dark'")


def test_the_help_names_every_key_and_closes(new_page):
    new_page.keyboard.press("h")
    keys = new_page.locator("#help kbd").all_inner_texts()
    assert {"space", *"[],.aruzZ+−0twslhnNb", "←", "→", "PgDn", "Esc"} <= set(keys)
    new_page.keyboard.press("Escape")
    assert new_page.locator("#help").is_hidden()
    new_page.keyboard.press("i")
    assert "positions within" in new_page.locator("#info").inner_text()


# -- other pages and other browsers -------------------------------------------------------------------------------------------------------


def test_names_on_the_page_are_only_names(watched, tmp_path):
    name = "</script><script>alert(1)</script><img src=x onerror=alert(2)>"
    blocks = [Block(name=f"<b>{name}", team=1, position=(0, 0, 10), motion=Still())]
    run = record(Mission(blocks=blocks, end=0.5, name=name), tmp_path / "<i>run")
    export = write_html(Recording(run), tmp_path / "page.html")
    page = opened(watched, export.path)
    assert page.locator("#head h1").inner_text() == name
    assert page.title() == name
    page.keyboard.press("ArrowRight")
    wait_until(page, "player.chosen === 1 && player.isDrawn")
    page.keyboard.press("i")
    assert name in page.locator("#chosen h2").inner_text()
    assert "<i>run" in page.locator("#info").inner_text()
    assert page.locator("img").count() == 0
    assert page.locator("b b, i i").count() == 0


def test_a_run_that_was_cut_short_says_so(watched, tmp_path):
    run = record(hunt(end=3.0), tmp_path / "run", flush_every=1e-9)
    (run / "run.json").unlink()
    page = opened(watched, write_html(Recording(run), tmp_path / "page.html").path)
    assert "cut short" in page.locator("#notice").inner_text()
    page.locator("#notice").click()
    assert "run.json is missing" in page.locator("#info .notes").inner_text()


HARBOUR = """<?xml version="1.0"?>
<runscript name="harbour">
  <run start="0" end="1" dt="0.1"/>
  <background_color>250 250 240</background_color>
  <entity_interaction name="quay" team_id="1" center="0, 0, 60" lengths="500, 400, 120">Boundary</entity_interaction>
  <entity_interaction name="buoy" team_id="1" shape="sphere" radius="50">Boundary</entity_interaction>
  <entity>
    <name>patrol</name><team_id>1</team_id><count>2</count><x>10</x><y>20</y><z>40</z>
    <base><x>-20</x><y>-12</y><z>5</z><radius>30</radius><opacity>0.5</opacity></base>
  </entity>
</runscript>
"""


def test_bases_boundaries_and_terrain_are_drawn(watched, tmp_path):
    (tmp_path / "harbour.xml").write_text(HARBOUR)
    loaded = read_mission(tmp_path / "harbour.xml")
    recording = Recording(record(loaded.mission, tmp_path / "run", mission_text=loaded.text))
    x, y = np.linspace(-300, 300, 30), np.linspace(-200, 200, 20)
    hills = Terrain(x, y, 10.0 * np.sin(x / 40.0) + y[:, None] / 9.0)
    recording.__dict__["scenery"] = replace(recording.scenery, terrain=hills)
    page = opened(watched, write_html(recording, tmp_path / "page.html").path)
    # The mission's background is a light one, so the page is light.
    assert page.evaluate("() => [player.drawn.theme, document.body.dataset.theme]") == ["mission", "light"]
    with_all = picture(page)
    page.locator("#tools [data-do=settings]").click()
    page.locator("#regions").uncheck()
    page.locator("#tools [data-do=settings]").click()
    wait_until(page, "!player.drawn.regions && player.isDrawn")
    changed = np.abs(picture(page) - with_all).max(axis=2) > 0.05
    assert 0.02 < changed.mean() < 0.98


def test_the_terrain_has_its_texture(watched, tmp_path):
    recording = Recording(
        record(Mission(blocks=[Block(name="robot", motion=Still())], end=0.2), tmp_path / "run")
    )
    x = np.linspace(-4.0, 4.0, 20)
    image = np.zeros((64, 64, 3), np.uint8)
    image[:32], image[32:] = (220, 0, 0), (0, 0, 220)  # the north is red
    hills = Terrain(x, x, np.zeros((20, 20)), image)
    recording.__dict__["scenery"] = replace(recording.scenery, terrain=hills)
    page = opened(watched, write_html(recording, tmp_path / "page.html").path)
    page.keyboard.press("v")  # from above, north up
    wait_until(page, "player.isDrawn")
    seen = picture(page)
    is_red = (seen[..., 0] > 0.5) & (seen[..., 1:].max(axis=2) < 0.3)
    is_blue = (seen[..., 2] > 0.5) & (seen[..., :2].max(axis=2) < 0.3)
    assert is_red.mean() > 0.03
    assert is_blue.mean() > 0.03
    assert np.flatnonzero(is_red.any(axis=1)).mean() < np.flatnonzero(is_blue.any(axis=1)).mean()


def test_two_fingers_come_nearer_on_a_narrow_screen(watched, hunted):
    page = opened(watched, hunted[1].path, viewport={"width": 400, "height": 800}, has_touch=True)
    assert page.evaluate("() => document.documentElement.scrollWidth") == 400
    distance = page.evaluate("() => player.camera.distance")
    page.evaluate(
        """() => {
            const view = document.getElementById('view');
            view.setPointerCapture = () => {};
            const touch = (kind, pointerId, clientX, clientY) =>
                view.dispatchEvent(new PointerEvent(kind, { pointerId, clientX, clientY, pointerType: 'touch' }));
            touch('pointerdown', 1, 150, 350);
            touch('pointerdown', 2, 250, 350);
            for (let k = 1; k <= 5; k++) { touch('pointermove', 1, 150 - 10 * k, 350); touch('pointermove', 2, 250 + 10 * k, 350); }
            touch('pointerup', 1, 100, 350);
            touch('pointerup', 2, 300, 350);
        }"""
    )
    wait_until(page, f"player.mode === 'free' && player.camera.distance < {0.7 * distance}")


@pytest.mark.parametrize(
    ("missing", "words"),
    [
        ("HTMLCanvasElement.prototype.getContext = () => null", "WebGL 2 or on a 2D canvas"),
        ("delete window.DecompressionStream", "DecompressionStream"),
    ],
)
def test_a_browser_that_cannot_show_it_says_why(watched, hunted, missing, words):
    page = watched(hunted[1].path.as_uri())
    page.add_init_script(missing)
    page.goto(hunted[1].path.as_uri())
    assert words in page.locator("#sorry").inner_text()
    assert not page.evaluate("() => Boolean(window.player)")


def test_a_page_that_was_cut_or_damaged_says_so(watched, hunted, tmp_path):
    text = hunted[1].path.read_text(encoding="utf-8")
    cut = tmp_path / "cut.html"
    cut.write_text(text[: len(text) // 2], encoding="utf-8")
    page = watched(cut.as_uri())
    page.goto(cut.as_uri())
    assert "not whole" in page.locator("#sorry").inner_text()
    damaged = tmp_path / "damaged.html"
    start = text.index(">", text.index('id="data-chunk-0"')) + 1
    damaged.write_text(text[:start] + "AAAA" + text[start + 4 :], encoding="utf-8")
    page = watched(damaged.as_uri())
    page.goto(damaged.as_uri())
    wait_until(page, "document.getElementById('sorry').textContent.includes('damaged')")
