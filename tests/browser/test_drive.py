"""An entity is driven by the keys of a browser, until it is given back."""

import time
from contextlib import contextmanager

import pytest
from page_client import PageClient
from served import UNHURRIED, Watched

from tussle import Block, Mission, Simulation
from tussle.stock import GoTo, SingleIntegrator, Still
from tussle.view import Live
from tussle.view.page import publisher
from tussle.view.page.server import Page

CATCH_SOCKET = """() => {
  const send = WebSocket.prototype.send;
  WebSocket.prototype.send = function (data) { window.socketOfPage = this; return send.call(this, data); };
}"""


@pytest.fixture(scope="module")
def game(chromium):
    kind = {"motion": SingleIntegrator(max_speed=5.0), "autonomy": GoTo(speed=2.0)}
    blocks = [
        Block(name="drone", team=1, count=2, position=(0, 0, 20), variance=(400, 400, 0), **kind),
        Block(name="post", team=1, position=(0, -40, 20), motion=Still()),
    ]
    with (
        Simulation(Mission(name="driven", blocks=blocks, end=3000.0, dt=0.1, end_conditions="time"), 3) as simulation,
        Live(simulation, pace=1.0) as live, Page(live, viewer=UNHURRIED) as page,
    ):  # fmt: skip
        yield live, page, chromium


@contextmanager
def opened(game):
    live, page, chromium = game
    watched = Watched(chromium, page, {"width": 1100, "height": 760})
    yield live, watched
    watched.close()
    assert not watched.trouble, "\n".join(watched.trouble)


@pytest.fixture(scope="module")
def kept(game):
    with opened(game) as found:
        yield found


def ready(live, watched):
    """Let nobody be driven, and choose the first drone."""
    watched.until(
        lambda: (
            watched.press("Escape")
            or (sticks(live) is None and not watched.tab.evaluate("() => player.chosen"))
        )
    )
    watched.press("o")
    watched.choose(1)
    watched.wait("!document.querySelector('#drive').hidden")
    return live, watched


@pytest.fixture
def driver(kept):
    """The page of the tests before."""
    return ready(*kept)


@pytest.fixture
def own_driver(game):
    """A page of its own, for tests that leave it unusable."""
    with opened(game) as found:
        yield ready(*found)


def sticks(live):
    return live.simulation.state.manual.get((0, 1))


def test_orders_that_are_refused_do_not_give_it_back(own_driver):
    live, watched = own_driver
    watched.tab.evaluate(CATCH_SOCKET)
    watched.press("j")
    watched.until(lambda: sticks(live) is not None)
    watched.tab.evaluate("() => socketOfPage.send(JSON.stringify({ do: 'remove', entities: [0] }))")
    watched.wait("document.body.innerText.includes('is not allowed')")
    watched.tab.keyboard.down("w")
    watched.until(lambda: max(map(abs, sticks(live))) > 0.6)
    # A window that is left has no keys that are held, also if it draws no more.
    watched.tab.evaluate(
        "() => { window.requestAnimationFrame = () => 0; window.dispatchEvent(new Event('blur')); }"
    )
    watched.until(lambda: sticks(live) == (0.0, 0.0, 0.0))


def test_a_page_that_stands_still_keeps_it_and_one_that_is_lost_gives_it_back(own_driver, monkeypatch):
    monkeypatch.setattr(publisher, "DRIVE_LEASE", 3.0)
    live, watched = own_driver
    watched.press("j")
    watched.until(lambda: sticks(live) is not None)
    began = time.monotonic()
    watched.until(lambda: sticks(live) is None or time.monotonic() - began > 5.0)
    assert sticks(live) is not None
    watched.tab.evaluate("() => { WebSocket.prototype.send = () => undefined; }")
    watched.until(lambda: sticks(live) is None)
    watched.wait("document.querySelector('#drive button').innerText === 'Take over'")


def test_a_gamepad_drives_it_and_closing_the_page_gives_it_back(own_driver):
    live, watched = own_driver
    watched.tab.evaluate("() => { navigator.getGamepads = () => [null, { axes: [0.05, 0, 0, -0.5] }]; }")
    watched.press("j")
    watched.until(lambda: sticks(live) == (0.0, 0.0, 64 / 127))
    watched.tab.goto("about:blank")
    for _ in range(3000):
        if sticks(live) is None:
            break
        watched.tab.wait_for_timeout(30)
    assert sticks(live) is None


def test_keys_drive_it_and_escape_gives_it_back(driver):
    live, watched = driver
    watched.button("Take over")
    watched.until(lambda: sticks(live) == (0.0, 0.0, 0.0))
    watched.tab.keyboard.down("w")
    watched.until(lambda: max(map(abs, sticks(live))) > 0.6)
    # Ahead is away from who looks.
    watched.until(lambda: abs(live.entity(1).body["vel"].value[:2]).max() > 3.0 if live.entity(1) else False)
    watched.tab.keyboard.down("e")
    watched.until(lambda: sticks(live)[2] == 1.0)
    watched.tab.keyboard.up("w")
    watched.tab.keyboard.up("e")
    watched.until(lambda: sticks(live) == (0.0, 0.0, 0.0))
    watched.wait("document.querySelector('#drive p').innerText.includes('velocity_y')")
    assert watched.tab.get_by_label("Camera", exact=True).is_visible()
    watched.tab.keyboard.press("Escape")
    watched.until(lambda: sticks(live) is None)
    assert watched.tab.evaluate("() => player.chosen") == 1


def test_who_is_refused_the_sticks_does_not_seem_to_drive(driver):
    live, watched = driver
    with PageClient(watched.page.url) as other:
        other.wait(lambda: other.status)
        other.order("drive", entities=[1], sticks=[0.5, 0.0, 0.0])
        watched.until(lambda: sticks(live) is not None)
        watched.press("j")
        watched.wait("document.body.innerText.includes('another browser drives entity 1')")
        watched.wait("document.querySelector('#drive button').innerText === 'Take over'")
        assert sticks(live) == pytest.approx((0.5, 0.0, 0.0), abs=0.01)
    watched.until(lambda: sticks(live) is None)


def test_what_cannot_be_driven_is_said(driver):
    _, watched = driver
    watched.press("Escape")
    watched.wait("player.chosen === 0")
    watched.press("j")
    watched.wait("document.body.innerText.includes('Click the entity that you want to drive')")
    watched.choose(3)
    refusal = "post 3 has no channel that keys can drive"
    watched.until(
        lambda: (
            watched.press("j") or watched.tab.evaluate(f"() => document.body.innerText.includes('{refusal}')")
        )
    )


def test_another_choice_gives_it_back(driver):
    live, watched = driver
    watched.press("j")
    watched.until(lambda: sticks(live) is not None)
    watched.choose(2)
    watched.until(lambda: sticks(live) is None)


def test_taken_over_again_at_once_it_stays_driven_until_a_jump_in_time(driver):
    live, watched = driver
    for _ in range(2):
        watched.press("j")
        watched.until(lambda: sticks(live) is not None)
        watched.press("Escape")
        watched.until(lambda: sticks(live) is None)
    # The state of the entity that the page has may still be that of the first time.
    watched.press("j")
    watched.until(lambda: sticks(live) is not None)
    seen = live.step_number
    watched.until(lambda: live.step_number > seen + 10)
    assert sticks(live) is not None
    live.seek(live.t - 0.4)
    watched.until(lambda: sticks(live) is None)
