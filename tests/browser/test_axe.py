"""Pages keep to the Web Content Accessibility Guidelines as far as axe-core can tell, and the keyboard alone suffices."""

from __future__ import annotations

import needs
import pytest
from served import UNHURRIED, Watched
from test_looks import watched_mission

from tussle import Block, Mission, Recorder, Simulation
from tussle.batch import Batch, load_batch
from tussle.batch.report import write_report
from tussle.stock import GoTo, SingleIntegrator
from tussle.stress import Monitor, Specification
from tussle.view import Live, Recording
from tussle.view.page.server import Page

CHECK = """async () => {
  const { violations } = await axe.run(document, { runOnly: ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa'] });
  return violations.flatMap(({ id, nodes }) => nodes.map(({ html }) => `${id}: ${html.slice(0, 120)}`));
}"""
FOCUSED = """() => {
  const { activeElement: node } = document;
  const { outlineStyle, outlineWidth } = getComputedStyle(node);
  const { left, top, width, height } = node.getBoundingClientRect();
  const there = document.elementFromPoint(left + width / 2, top + height / 2);
  const isShown = node.contains(there) && node.checkVisibility() && outlineStyle !== 'none' && outlineWidth !== '0px';
  return [node === document.body, isShown, node.outerHTML.slice(0, 120)];
}"""


@pytest.fixture(scope="module")
def axe():
    needs.require("axe")
    script = needs.axe()
    assert script is not None
    return script.read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def live():
    mission = watched_mission()
    with Simulation(mission, 3) as simulation:
        monitor = Monitor(Specification.parse("always (count(team 1) > 3)", mission), simulation)
        with (
            Live(simulation, is_paused=True, specifications=[monitor]) as live,
            Page(live, viewer=UNHURRIED) as page,
        ):
            live.step(60)
            assert live.settle()
            yield page


@pytest.mark.parametrize(("width", "height"), [(1000, 640), (390, 700)])
def test_axe_finds_nothing_on_a_live_page(chromium, axe, live, width, height):
    watched = Watched(chromium, live, {"width": width, "height": height})
    watched.wait("player.frame === 60")
    watched.tab.evaluate(axe)
    found = []

    def check(key):
        watched.press(key)
        watched.wait("player.isDrawn")
        found.extend(watched.tab.evaluate(CHECK))

    for _ in ("dark", "light"):
        check("k")
        check("d")  # before an entity is chosen, whose panel lies below the settings
        watched.press("d")
        watched.press("ArrowRight")
        watched.wait("player.status.entity && document.querySelector('#sections section')")
        for key in ("q", "f"):  # panels are opened beside each other, dialogs one after another
            check(key)
        for key in ("h", "i"):
            check(key)
            watched.tab.keyboard.press("Escape")
        for key in ("q", "f", "Escape"):
            watched.press(key)
    watched.close()
    assert not sorted(set(found))


def test_axe_finds_nothing_on_a_replay_and_a_report(chromium, axe, tmp_path):
    mission = watched_mission()
    with Simulation(mission, 3) as simulation, Recorder(simulation, tmp_path / "run"):
        simulation.run()
    with Page(Recording(tmp_path / "run"), is_paused=True) as page:
        watched = Watched(chromium, page)
        watched.press("ArrowRight")
        watched.wait("player.isDrawn")
        watched.tab.evaluate(axe)
        found = watched.tab.evaluate(CHECK)
        watched.close()
    Batch(mission, runs=3).play(tmp_path / "batch")
    index = write_report(load_batch(tmp_path / "batch"), tmp_path / "report").index
    for scheme in ("dark", "light"):
        tab = chromium.new_page(color_scheme=scheme)
        tab.goto(index.as_uri())
        tab.evaluate(axe)
        found += tab.evaluate(CHECK)
        tab.close()
    assert not sorted(set(found))


def test_keys_alone_choose_an_entity_order_it_somewhere_and_remove_it(chromium):
    """Tab goes through all that can be used, and shows where it is."""
    block = Block(
        name="drone",
        team=1,
        count=2,
        variance=(400, 400, 0),
        autonomy=GoTo(),
        motion=SingleIntegrator(max_speed=9.0),
    )
    with (
        Simulation(Mission(blocks=[block], end=3000.0, dt=0.1, end_conditions="time"), 3) as simulation,
        Live(simulation, is_paused=True) as live,
        Page(live, viewer=UNHURRIED) as page,
    ):
        watched = Watched(chromium, page, {"width": 1200, "height": 560})
        keys = watched.tab.keyboard
        keys.press("ArrowRight")
        watched.wait("document.querySelector('#orders') && !document.querySelector('#orders').hidden")
        seen = []
        for _ in range(70):
            keys.press("Tab")
            seen.append(watched.tab.evaluate(FOCUSED))
        rounds = [k for k, (is_body, _, _) in enumerate(seen) if is_body]
        assert len(rounds) >= 2
        assert [html for _, is_shown, html in seen[: rounds[0]] if not is_shown] == []

        def tab_to(selector):
            for _ in range(200):
                if watched.tab.evaluate("(css) => document.activeElement.matches(css)", selector):
                    return
                keys.press("Tab")
            raise AssertionError(f"the Tab key does not reach {selector}")

        tab_to("#order")
        keys.type("Way")  # the order that sends it to a point
        tab_to("#orders input[type=number], #orders input[type=text]")
        for value in ("70", "30", "0"):
            keys.press("Control+a")
            keys.type(value)
            keys.press("Tab")
        tab_to("#orders button[type=submit], #orders button.send")
        keys.press("Enter")
        watched.until(lambda: live.injections)
        (given,) = live.injections
        assert given.fields["pos"].reshape(-1)[:2].tolist() == [70.0, 30.0]
        watched.close()
        assert not watched.trouble
