"""Orders that are typed on the page of a live game: who gets them, what is refused, and that they are part of the game."""

from contextlib import contextmanager

import numpy as np
import pytest
from served import UNHURRIED, Watched

from tussle import Block, Mission, Recorder, Simulation
from tussle.api import Autonomy, Output, Publish, State, Subscribe
from tussle.declare.columns import EntityRef, Field, Handle
from tussle.messages import Message, TextMessage
from tussle.record import load_inputs
from tussle.stock import GoTo, SingleIntegrator
from tussle.view import Live
from tussle.view.page.server import Page


class Errand(Message):
    """An errand of a stranger."""

    way = Field("x y z", "m m m", ragged=True, doc="Places in order.")
    marks = Field("left right", "m 1")
    times = Field(dtype=int)
    hurry = Field(dtype=bool)
    partner = EntityRef()
    note = Handle(is_text=True)


class Runner(Autonomy):
    """Keeps what it is told."""

    errands = Subscribe(Errand, from_outside=True)
    report = Publish(TextMessage)
    told = State("items left right times hurry partner length", dtype=float)
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    def step(self, g):
        rows, heard = self.errands.latest()
        for k, row in enumerate(rows):
            left, right = heard.marks[:, k]
            numbers = (
                heard.way.count[k],
                left,
                right,
                heard.times[k],
                heard.hurry[k],
                heard.partner[k],
                len(heard.note[k] or ""),
            )
            self.told[:, row] = numbers
        self.report.publish(np.arange(g.n), text=[f"{n:g} places" for n in self.told[0]], to=0)


def mission():
    kind = {"motion": SingleIntegrator(max_speed=20.0), "placement": "uniform", "half_width": (30, 30, 0)}
    return Mission(
        name="errands", end=300.0, dt=0.1, end_conditions="time",
        blocks=[
            Block(name="drone", team=1, count=3, position=(0, 0, 20), autonomy=GoTo(speed=15.0), **kind),
            Block(name="runner", team=1, count=2, position=(100, 0, 20), autonomy=Runner(), **kind),
        ],
    )  # fmt: skip


@contextmanager
def opened(chromium):
    """A game that stands still, and a browser that shows it."""
    with (
        Simulation(mission(), 3) as simulation,
        Live(simulation, is_paused=True, pace=1.0) as live,
        Page(live, viewer=UNHURRIED) as page,
    ):
        watched = Watched(chromium, page, {"width": 1100, "height": 760})
        yield live, watched
        watched.close()
        assert not watched.trouble, "\n".join(watched.trouble)


@pytest.fixture(scope="module")
def game(chromium):
    with opened(chromium) as found:
        yield found


def choose(watched, who):
    """Choose an entity, and wait for its orders."""
    watched.choose(who)
    watched.wait("!document.querySelector('#orders').hidden")


def step(live, n=1):
    live.step(n)
    assert live.settle()


def column(live, path):
    return np.nan_to_num(live.simulation.read(path)[0][0])


def test_orders_are_carried_out_and_belong_to_the_game(chromium, tmp_path):
    with opened(chromium) as (live, watched), Recorder(live.simulation, tmp_path / "run") as recorder:
        give_all_orders(live, watched)
        recorder.flush()
        with Simulation(mission(), 3) as again:
            again.play_inputs(load_inputs(recorder.directory))
            again.step(13)
            assert again.state_hash() == live.simulation.state_hash()


def give_all_orders(live, watched):
    """Give an order of each kind, in 13 steps."""
    tab = watched.tab
    choose(watched, 1)
    fields = tab.locator("#orders fieldset input")
    for k, value in enumerate(("200", "100", "30")):
        fields.nth(k).fill(value)
    watched.button("Send")
    watched.until(lambda: len(live.injections) == 1 and live.settle())
    step(live, 3)
    assert column(live, "drone.GoTo.goal")[0].tolist() == [200, 100, 30]
    assert column(live, "drone.GoTo.is_told").tolist() == [True, False, False]

    # To the whole block, a point on the ground at the height of the chosen one.
    tab.locator("#receivers").select_option("block")
    watched.wait("player.frame === 3 && player.isDrawn")
    watched.button("Point on the ground")
    tab.mouse.click(500, 330)
    frame = live.frame()
    height = float(frame.pos[frame.id.tolist().index(1), 2])
    watched.wait(f"document.querySelectorAll('#orders fieldset input')[2].value === '{height:.1f}'")
    watched.button("Send")
    watched.until(lambda: len(live.injections) == 2 and live.settle())
    assert live.injections[1].to == (1, 2, 3)
    step(live, 3)
    goals = column(live, "drone.GoTo.goal")
    assert (goals == goals[0]).all()
    assert goals[0, 0] != 200

    # A parameter, for one.
    tab.locator("#receivers").select_option("one")
    tab.locator("#order").select_option(label="GoTo.speed")
    tab.get_by_label("value", exact=True).fill("3.5")
    watched.button("Send")
    watched.until(lambda: len(live.injections) == 3 and live.settle())
    step(live, 1)
    assert column(live, "drone.GoTo.speed").tolist() == [3.5, 15, 15]

    # A stranger's message, of all kinds of fields; what is no number is not sent.
    choose(watched, 4)
    tab.locator("#receivers").select_option("one")
    typed = {"times": "3", "partner": "5", "note": "quick"}
    for name, value in typed.items():
        tab.get_by_label(name, exact=True).fill(value)
    tab.get_by_label("hurry", exact=True).check()
    for part, value in (("left", "1.5"), ("right", "-2")):
        tab.get_by_label(f"marks {part}", exact=True).fill(value)
    way = tab.get_by_label("way", exact=True)
    way.fill("1 2 3\n4 5 x")
    watched.button("Send")
    watched.wait("document.querySelector('#said').innerText.startsWith('way: numbers')")
    way.fill("1 2 3\n4 5 6")
    watched.button("Add a point on the ground")
    tab.mouse.click(500, 330)
    watched.wait("document.querySelector('#orders textarea').value.split('\\n').length === 3")
    watched.button("Send")
    watched.until(lambda: len(live.injections) == 4 and live.settle())
    step(live, 2)
    assert column(live, "runner.Runner.told").tolist() == [[3, 1.5, -2, 3, 1, 5, 5], [0] * 7]

    # One more of its block, on the ground that is picked.
    tab.locator("#order").select_option(label="Add one to runner")
    watched.button("Send")
    watched.wait("document.querySelector('#said').innerText.startsWith('position: x, y, z')")
    watched.button("Point on the ground")
    tab.mouse.click(500, 330)
    watched.wait("document.querySelectorAll('#orders fieldset input')[2].value !== ''")
    x, y, z = (float(tab.get_by_label(f"position {part}").input_value()) for part in "xyz")
    watched.button("Send")
    watched.until(lambda: len(live.injections) == 5 and live.settle())
    step(live, 2)
    frame = live.frame()
    assert frame.id.tolist() == [1, 2, 3, 4, 5, 6]
    assert frame.block[-1] == 1
    assert np.allclose(frame.pos[-1], (x, y, z))

    tab.locator("#order").select_option("remove")
    watched.button("Send")
    watched.until(lambda: len(live.injections) == 6 and live.settle())
    step(live, 2)
    assert 4 not in live.frame().id
    watched.wait("document.querySelector('#orders').hidden")

    there = live.simulation.state_hash()
    live.seek(0.1)
    step(live, 12)
    assert live.simulation.state_hash() == there


def test_a_route_is_drawn_in_one_stroke(game):
    _, watched = game
    tab = watched.tab
    choose(watched, 5)
    tab.locator("#order").select_option("0")
    way = tab.get_by_label("way", exact=True)
    way.fill("1 2 3")
    corners = [(350, 300), (500, 300), (500, 420)]
    watched.button("Draw a line")
    tab.mouse.move(*corners[0])
    tab.mouse.down()
    for corner in corners:
        tab.mouse.move(*corner, steps=15)
    tab.mouse.up()
    watched.wait("document.querySelector('#orders textarea').value.split('\\n').length > 1")
    drawn = way.input_value().split("\n")

    # The same as the corners that are picked one by one: the view has not turned, and the points between are gone.
    way.fill("1 2 3")
    for n, corner in enumerate(corners, 2):
        watched.button("Add a point on the ground")
        tab.mouse.click(*corner)
        watched.wait(f"document.querySelector('#orders textarea').value.split('\\n').length === {n}")
    assert way.input_value().split("\n") == drawn

    watched.button("Draw a line")
    tab.mouse.click(*corners[0])
    watched.wait("document.querySelector('#said').innerText.startsWith('No line is drawn')")
    assert way.input_value().split("\n") == drawn


def test_the_messages_of_the_game_are_shown_while_they_are_asked_for(game):
    live, watched = game
    tab = watched.tab
    assert not live.simulation.events.taps
    watched.press("f")
    watched.wait("!document.querySelector('#silence').hidden")
    watched.until(lambda: live.simulation.events.taps)
    frame = live.frame()
    runners = frame.id[frame.block == 1].tolist()
    live.step(15)
    assert live.settle()
    watched.wait(f"document.querySelector('#feed li')?.innerText.includes('{10 * len(runners)}/s')")
    assert f"{runners[-1]}: text 0 places" in tab.locator("#feed li p").inner_text()
    assert "GlobalNetwork/TextMessage" in tab.locator("#feed li b").inner_text()
    tab.locator("#topics").fill("waypoint")
    watched.wait("document.querySelectorAll('#feed li').length === 0")
    watched.press("q")
    assert tab.locator("#feed").is_hidden()
    watched.until(lambda: not live.simulation.events.taps)
    watched.press("q")


@pytest.mark.parametrize(
    "command",
    [
        {"receivers": [], "network": "LocalNetwork", "topic": "Waypoint", "values": {}},
        {"receivers": [1] * 1001, "network": "LocalNetwork", "topic": "Waypoint", "values": {}},
        {"receivers": [1], "network": "LocalNetwork", "topic": "Waypoints", "values": {}},
        {"receivers": [1], "network": "LocalNetwork", "topic": "Waypoint", "values": {"pos": [1, 2]}},
        {
            "receivers": [1],
            "network": "LocalNetwork",
            "topic": "Waypoint",
            "values": {"pos": [1, 2, {"a": 1}]},
        },
        {"receivers": [1], "network": "LocalNetwork", "topic": "Waypoint", "values": {"place": [1, 2, 3]}},
        {"receivers": [1], "network": "LocalNetwork", "topic": "Waypoint", "values": [1]},
        {"receivers": ["1"], "network": 3, "topic": "Waypoint", "values": {"pos": [1, 2, 3]}},
    ],
)
def test_other_orders_are_refused_and_change_nothing(game, command):
    live, watched = game
    assert live.settle()
    n, hash_ = len(live.injections), live.simulation.state_hash()
    watched.tab.evaluate(
        """(command) => new Promise((done) => {
            const socket = new WebSocket(location.href.replace('http', 'ws'));
            socket.onopen = () => { socket.send(JSON.stringify({ do: 'order', ...command })); };
            socket.onmessage = ({ data }) => {
                if (typeof data === 'string' && JSON.parse(data).refusal) { socket.close(); done(); }
            };
        })""",
        command,
    )
    assert live.settle()
    assert (len(live.injections), live.simulation.state_hash()) == (n, hash_)
