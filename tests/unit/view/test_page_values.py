"""Nothing that a page sends ends a game, and an error of the page is told on it: seen by one who speaks its protocol."""

import math
import time

import numpy as np
import pytest
from page_client import PageClient
from recorded_games import hunt
from watched_plugins import clickable

from tussle import Simulation
from tussle.errors import ParameterError
from tussle.view import Live
from tussle.view.page.server import Page

NAN, INF = math.nan, math.inf
NO_NUMBERS = (NAN, INF, -INF, -1.0, 1e308, -1e308, 2**63, None, True, "5", "x" * 9000, [], [1.0], {}, b"5")
NO_TEXTS = (NAN, 0, None, True, "", "nothing of that name", "x" * 9000, [], ["Play"], {"a": 1}, b"Play")
NO_SWITCHES = (NAN, 0, 1, 2, None, "true", "", [], {}, b"1")


@pytest.fixture(scope="module")
def shared():
    """A page on a game that goes on, with all that can be drawn."""
    with (
        Simulation(hunt(end=1e5, end_conditions="time"), 3) as simulation,
        Live(simulation, pace=1.0) as live,
        Page(live) as page,
        PageClient(page.url) as client,
    ):
        client.wait(page.visitors)
        for label in ("Trails", "Rings", "Cones", "Links", "Names"):
            client.set(label, True)
        client.wait(lambda: page.display.has_links and page.display.has_cones)
        yield live, page, client


@pytest.fixture
def game(shared):
    """The page; after each test its game goes on and it is drawn."""
    yield shared
    live, page, client = shared
    live.resume()
    step, frames = live.step_number, client.n_frames
    client.wait(lambda: live.step_number > step and client.n_frames > frames + 2)
    assert (page.error, live.error, page.pusher.is_alive) == (None, None, True)


def is_told_to_be_refused(client, label):
    """Wait until it is: of many refused values in a row, only the first is told."""

    def is_told():
        client.set(label, NAN)
        time.sleep(0.2)
        return any(label in n["title"] for n in client.notifications)

    client.wait(is_told)


@pytest.mark.parametrize(
    ("label", "attribute", "good"),
    [
        ("Trails [s]", "trail_time", 3.0),
        ("Radius [m]", "ring_radius", 20.0),
        ("Range [m]", "cone_range", 20.0),
        ("Up to [m]", "link_range", 20.0),
        ("Models", "model_scale", 2.0),
        ("Names' size", "label_scale", 2.0),
        ("Angle [°]", "cone_angle", 90.0),
    ],
)
def test_numbers_that_are_none_are_refused(game, label, attribute, good):
    _, page, client = game
    before = getattr(page.display, attribute)
    for value in NO_NUMBERS:
        client.set(label, value)
    is_told_to_be_refused(client, label)
    assert getattr(page.display, attribute) == before
    client.set(label, good)
    client.wait(lambda: getattr(page.display, attribute) in (good, math.radians(good)))
    time.sleep(0.6)


@pytest.mark.parametrize("label", ["Trails [s]", "Radius [m]", "Range [m]", "Up to [m]"])
@pytest.mark.parametrize("value", [0, 1e-300, 1e-3, 1e6])
def test_lengths_may_be_none_and_long(game, label, value):
    _, page, client = game
    client.set(label, value)
    time.sleep(0.6)
    assert page.error is None
    client.set(label, 5.0)


@pytest.mark.parametrize("label", ["Time [s]", "Entity", "Seed"])
def test_times_ids_and_seeds_that_are_none_are_refused(game, label):
    live, page, client = game
    epoch, chosen, seed = live.epoch, page.visitors()[0].chosen, client.value("Seed")
    for value in (*NO_NUMBERS, *((1.5, 2**31) if label != "Time [s]" else ())):
        client.set(label, value)
    is_told_to_be_refused(client, label)
    client.set("Models", 1.5)
    client.wait(lambda: page.display.model_scale == 1.5)
    assert (live.epoch, page.visitors()[0].chosen, client.value("Seed")) == (epoch, chosen, seed)
    client.set("Models", 1.0)


@pytest.mark.parametrize("who", [999, 2**31 - 1])
def test_an_id_that_nobody_has_is_nobody(game, who):
    _, page, client = game
    client.set("Entity", who)
    client.wait(lambda: page.visitors()[0].chosen == who)
    client.wait(lambda: client.text("is not there at this time"))
    client.set("Entity", 0)


@pytest.mark.parametrize("label", ["Run", "Speed", "Event", "Jump", "Mode", "View"])
def test_choices_that_are_not_offered_are_refused(game, label):
    live, page, client = game
    live.pause()
    live.settle()
    step, warp = live.step_number, live.warp
    for value in NO_TEXTS:
        client.set(label, value)
    client.set("Models", 1.5)
    client.wait(lambda: page.display.model_scale == 1.5)
    assert (live.step_number, live.warp, live.is_paused) == (step, warp, True)
    client.set("Models", 1.0)


@pytest.mark.parametrize(
    ("label", "attribute"),
    [("Names", "has_labels"), ("Trails", "has_trails"), ("Edges only", "is_wireframe"), ("Plugins' shapes", "has_drawn"),
     ("Rings", "has_rings"), ("Cones", "has_cones"), ("Links", "has_links")],
)  # fmt: skip
def test_switches_are_on_or_off(game, label, attribute):
    _, page, client = game
    before = getattr(page.display, attribute)
    for value in NO_SWITCHES:
        client.set(label, value)
    client.set(label, not before)
    client.wait(lambda: getattr(page.display, attribute) is (not before))
    client.set(label, before)
    client.wait(lambda: getattr(page.display, attribute) is before)


def test_elements_and_keys_that_are_not_there_are_ignored(game):
    _, _, client = game
    for uuid in ("", "root", "x" * 5000, None, 5, NAN, [], {"a": 1}):
        client.send("GuiUpdateMessage", uuid=uuid, updates={"value": 1.0})
        client.send("CommandTriggerMessage", uuid=uuid)


@pytest.mark.parametrize("bad", [NAN, INF, 1e308, None, "0", []])
def test_cameras_and_clicks_that_are_nowhere_are_ignored(game, bad):
    _, page, client = game
    (visitor,) = page.visitors()
    client.set("Mode", "follow")
    client.send_camera((bad, 0.0, 0.0), (0.0, 0.0, 0.0))
    client.send_camera((1.0, 0.0, 0.0), (0.0, bad, 0.0))
    client.click_ground((0.0, 0.0, bad), (0.3, 0.4, -1.0))
    client.click_ground((0.0, 0.0, 100.0), (0.3, bad, -1.0))
    client.wait(lambda: "/entities/aircraft" in client.nodes)
    for node, instance in (("/entities/aircraft", bad), ("/entities/aircraft", 2**40), ("/nowhere", 0)):
        client.click(node, instance) if node in client.nodes else None
    client.set("Mode", "free")
    client.wait(lambda: visitor.camera.mode == "free")
    assert np.isfinite(visitor._client.camera.position).all()


def test_a_camera_at_its_own_target_is_no_end(game):
    live, _, client = game
    client.set("Entity", int(live.frame().id[0]))
    client.send_camera((1.0, 1.0, 1.0), (1.0, 1.0, 1.0))
    for key in ("A", "Z", "Shift + Z", "R", "V", "U", "A", "A"):
        client.press(key)
    client.set("Mode", "free")
    client.set("Entity", 0)


def test_zoom_has_ends(game):
    live, page, client = game
    client.set("Entity", int(live.frame().id[0]))
    client.set("Mode", "behind")
    (visitor,) = page.visitors()
    client.wait(lambda: visitor.camera.mode == "behind")
    for nearer in (True, False):
        for _ in range(5000):
            visitor.zoom(nearer)
        assert 0.0 < visitor.camera._distance < 1e5 * live.scenery.size
    client.set("Mode", "free")
    client.set("Entity", 0)


def test_every_button_and_key_at_any_moment(game):
    live, page, client = game
    client.wait(lambda: len(client.commands) > 20)
    for is_paused in (True, False):
        (live.pause if is_paused else live.resume)()
        for command in list(client.commands):
            client.send("CommandTriggerMessage", uuid=command)
        for label, options in (
            ("Run", ("Back", "Pause", "Play", "Step")), ("Speed", ("Slower", "1 ×", "Faster", "Max")),
            ("Jump", ("Last event", "Next event")), ("View", ("Whole", "Above", "Undo")),
        ):  # fmt: skip
            for option in options:
                client.set(label, option)
        for label in ("Pick a point", "Press ;", "Begin anew"):
            client.set(label, True)
    client.set("Speed", "1 ×")
    client.set("Names' size", 7.0)
    client.wait(lambda: page.display.label_scale == 7.0)
    live.settle()


def test_a_point_too_far_away_is_no_point():
    with (
        Simulation(clickable(), 1) as simulation,
        Live(simulation, is_paused=True) as live,
        Page(live) as page,
        PageClient(page.url) as client,
    ):
        client.wait(page.visitors)
        client.press("O")
        client.wait(lambda: client.notifications)
        client.click_ground((0.0, 0.0, 100.0), (1.0, 0.0, -1e-9))
        client.wait(lambda: any(n["title"] == "No point" for n in client.notifications))
        assert not live.injections
        assert page.error is None


# -- errors of the page -----------------------------------------------------------------------------------------------------------


@pytest.fixture
def fragile():
    """A page that will fail, on a game that goes on."""
    with (
        Simulation(hunt(end=1e5, end_conditions="time"), 3) as simulation,
        Live(simulation, pace=1.0) as live,
        Page(live) as page,
        PageClient(page.url) as client,
    ):
        client.wait(page.visitors)
        yield live, page, client


def fail(*_, **__):
    raise RuntimeError("<b>no</b> such thing")


def is_told_and_goes_on(live, page, client):
    client.wait(lambda: client.text("&lt;b&gt;no&lt;/b&gt; such thing"))
    assert [text for text in page.errors if "RuntimeError: <b>no</b> such thing" in text] == page.errors
    assert isinstance(page.error, RuntimeError)
    step, frames = live.step_number, client.n_frames
    client.wait(lambda: live.step_number > step + 3 and client.n_frames > frames + 3)
    assert live.error is None


@pytest.mark.parametrize(
    ("method", "label", "value"),
    [("seek", "Time [s]", 0.0), ("pause", "Run", "Pause"), ("faster", "Speed", "Faster"), ("reset", "Begin anew", True)],
)  # fmt: skip
def test_a_control_that_fails_is_told_and_the_game_goes_on(fragile, monkeypatch, method, label, value):
    live, _, client = fragile
    client.wait(lambda: live.step_number > 3)
    client.wait(lambda: client.value("Time [s]") > 0.0)
    monkeypatch.setattr(live, method, fail)
    client.set(label, value)
    is_told_and_goes_on(*fragile)


def test_a_key_a_click_and_a_choice_that_fail_are_told(fragile, monkeypatch):
    _, page, client = fragile
    (visitor,) = page.visitors()
    monkeypatch.setattr(visitor, "cycle_mode", fail)
    client.press("A")
    is_told_and_goes_on(*fragile)
    for method in ("choose", "set_mode"):
        page.errors.clear()
        monkeypatch.setattr(visitor, method, fail)
        client.click("/entities/aircraft", 0) if method == "choose" else client.set("Mode", "behind")
        client.wait(lambda: page.errors)


@pytest.mark.parametrize("part", ["stage", "labels", "trails", "overlays", "drawn", "panel"])
def test_a_part_that_cannot_be_drawn_is_told_and_the_others_are_drawn(fragile, monkeypatch, part):
    live, page, client = fragile
    monkeypatch.setattr(getattr(page.pusher._parts, part), "show", fail)
    client.wait(lambda: page.errors)
    assert "RuntimeError: <b>no</b> such thing" in page.errors[0]
    assert len(page.errors) == 1, "each is told once"
    step = live.step_number
    client.wait(lambda: live.step_number > step + 3)
    if part != "panel":
        client.wait(lambda: client.text("such thing"))
    assert page.pusher.is_alive


def test_what_is_told_has_an_end(fragile, monkeypatch):
    from tussle.view.page.failures import MOST_FAILURES

    _, page, client = fragile
    numbers = iter(range(1000))

    def fail_anew(*_):
        raise RuntimeError(f"number {next(numbers)} {'x' * 9000}")

    monkeypatch.setattr(page.pusher._parts.labels, "show", fail_anew)
    client.wait(lambda: len(page.errors) > MOST_FAILURES)
    time.sleep(0.3)
    assert len(page.errors) == MOST_FAILURES + 1
    assert page.errors[-1] == "further errors of the page are not listed"
    assert max(map(len, page.errors)) < 500


def test_a_state_that_cannot_be_made_is_a_note_and_the_game_goes_on(fragile, monkeypatch):
    live, _, client = fragile
    monkeypatch.setattr("tussle.view.live.entity_state", fail)
    client.set("Entity", int(live.frame().id[0]))
    client.wait(lambda: client.text("such thing"))
    step = live.step_number
    client.wait(lambda: live.step_number > step + 3)
    assert any("RuntimeError" in note for note in live.notes)


@pytest.mark.parametrize("t", [1e308, -1e308, 10**400])
def test_a_time_that_no_step_has_is_refused(fragile, t):
    live, _, _ = fragile
    with pytest.raises(ParameterError, match="it takes a time in s"):
        live.seek(t)
