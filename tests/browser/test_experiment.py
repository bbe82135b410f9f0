"""docs/experiment.md: its commands as they are printed, with scripted people at the page in a browser, and its figures."""

import re
import shlex
import shutil
import subprocess

import pytest
from cli_process import COMMAND, environment
from contrast import faint_texts
from experiment_people import FIRST, MISSION, N_ORDERS, WAYS, check_figures, games, play_without_page, printed
from pages import ROOT
from served import READY
from waiting import wait_until

from tussle import load_run
from tussle.record import load_inputs

PLACES = "Object.fromEntries(player.ids.map((id) => [id, player.stateOf(id).pos]))"
BEHIND = "['--sky', '--ground'].map((name) => getComputedStyle(document.body).getPropertyValue(name).trim())"


def order(tab, boat, whom, place):
    """Choose a boat by keys, and send it or its block a waypoint by the form, without a mouse."""
    tab.evaluate("() => document.activeElement?.blur()")
    tab.keyboard.press("Escape")
    for _ in range(boat):
        tab.keyboard.press("ArrowRight")
    is_offered = "player.isDrawn && !document.querySelector('#orders').hidden"
    wait_until(tab, f"player.chosen === {boat} && player.status.entity?.id === {boat} && {is_offered}")
    tab.locator("#receivers").select_option(whom)
    tab.locator("#orders fieldset input").first.focus()
    for value in place:
        tab.keyboard.press("Control+a")
        tab.keyboard.type(f"{value:.1f}")
        tab.keyboard.press("Tab")
    tab.keyboard.press("Shift+Tab")
    tab.keyboard.press("Enter")
    who = f"boat {boat}" if whom == "one" else "3 entities"
    wait_until(tab, f"document.querySelector('#said').innerText.startsWith('Waypoint for {who}')")


def check_looks(tab, name):
    """The page says who operates, in colours that can be read in the dark and in the light."""
    wait_until(tab, f"document.querySelector('#subtitle').innerText.includes('{name}, you operate team 1')")
    for _ in ("light", "dark"):
        tab.keyboard.press("k")
        tab.wait_for_timeout(500)
        behind = [[int(each[i : i + 2], 16) for i in (1, 3, 5)] for each in tab.evaluate(f"() => {BEHIND}")]
        assert not faint_texts(tab, behind)


def press(leader, is_paused):
    """Let the game wait, or go on."""
    leader.keyboard.press("Space")
    wait_until(leader, f"player.status && player.status.isPaused === {str(is_paused).lower()}")


def play(chromium, command, folder):
    """Play a game of the page as one person, with a leader who lets it wait; returns the person, and what was printed."""
    process = subprocess.Popen(
        [*COMMAND, *shlex.split(command)[1:], "--no-browser"],
        cwd=folder, env=environment(), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    )  # fmt: skip
    try:
        lines = [process.stdout.readline()]
        while not (found := re.match(r" (\w+) \(operate team 1\): (http\S+)", lines[-1])):
            assert lines[-1], lines
            lines.append(process.stdout.readline())
        name, address, leader = found[1], found[2], re.search(r"http://\S+", lines[-2])[0]
        tab = chromium.new_page(viewport={"width": 900, "height": 640}, reduced_motion="reduce")
        tab.goto(address)
        wait_until(tab, f"{READY} && player.ids.length === 15 && player.status")
        check_looks(tab, name)
        places = {int(who): place for who, place in tab.evaluate(f"() => {PLACES}").items()}
        first, second = WAYS[name](places)
        for each in first:
            order(tab, *each)
        begin = chromium.new_page(viewport={"width": 300, "height": 200})
        begin.goto(leader)
        wait_until(begin, READY)
        press(begin, is_paused=False)
        wait_until(begin, f"player.status.t >= {FIRST}", 300.0)
        press(begin, is_paused=True)
        for each in second:
            order(tab, *each)
        press(begin, is_paused=False)
        for _ in range(4):
            begin.keyboard.press("]")
        process.communicate(timeout=300)
        assert process.returncode == 0
        tab.close()
        begin.close()
    finally:
        process.kill()
        process.communicate(timeout=60)
    return name, "".join(lines[-2:])


def without_secrets(text):
    """Addresses without port and secret part."""
    return re.sub(r"http://127\.0\.0\.1:\d+/\S+", "ADDRESS", text).strip()


@pytest.mark.slow
def test_the_experiment_of_the_page(chromium, tmp_path):
    shutil.copytree((ROOT / MISSION).parent, (tmp_path / MISSION).parent)
    for command in games()[2:]:  # their figures; a game at the page takes almost a minute
        play_without_page(command, tmp_path)
    for number, command in enumerate(games()[:2]):
        name, lines = play(chromium, command, tmp_path)
        if number == 0:
            assert without_secrets(lines) == without_secrets(printed(command))
        folder = tmp_path / re.search(r"--record (\S+)", command)[1]
        assert load_run(folder).is_complete
        assert [each.by for each in load_inputs(folder)] == N_ORDERS[name] * [f"{name} (operate team 1)"]
    check_figures(tmp_path)
