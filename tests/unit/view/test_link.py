"""Orders that come over a slow link that loses some."""

import time
from contextlib import contextmanager

import pytest
from page_client import PageClient, browsed

from tussle import Block, Mission, Recorder, Simulation
from tussle.api import Autonomy, Field, Handle, Message, Output, State, Subscribe
from tussle.errors import ParameterError
from tussle.messages import ManualControl
from tussle.record import given_by, load_inputs
from tussle.stock import SingleIntegrator
from tussle.view import Live, OperatorLink
from tussle.view.page.seen import MAX_KEPT, SeenDetails, SeenGame, SeenMoment
from tussle.view.page.server import Page

DT = 0.1


class Go(Message):
    """Go with a speed."""

    speed = Field(unit="m/s")
    note = Handle(is_text=True)


class Parcel(Message):
    """Anything."""

    content = Handle()


class Obedient(Autonomy):
    """Does what it heard last, and counts what it has heard."""

    orders = Subscribe(Go, from_outside=True)
    n_heard = State()
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    def step(self, g):
        rows, heard = self.orders.latest()
        self.velocity[0, rows] = heard.speed
        self.n_heard[rows] += 1.0


def mission():
    """Three robots that obey."""
    block = Block(
        name="robot", team=1, count=3, variance=(90, 90, 0), autonomy=Obedient(), motion=SingleIntegrator()
    )
    return Mission(name="linked", blocks=[block], dt=DT, end=1e3, end_conditions="time")


@contextmanager
def linked(link, seed=1):
    """The game, whose orders come over a link."""
    with (
        Simulation(mission(), seed) as simulation,
        Live(simulation, threaded=False, is_paused=True, link=link) as live,
    ):
        yield live


def ordered(link, sends, n_steps=60, seed=1):
    """Steps at which orders came, and the hash at the end. `sends` maps steps to speeds, sent to robot 2."""
    with linked(link, seed) as live:
        for step in range(n_steps):
            for speed in sends.get(step, ()):
                live.publish(Go, receivers=[2], speed=speed, note="go")
            live.step(1)
        return [each.step for each in live.injections], live.simulation.state_hash()


@pytest.mark.parametrize(("delay", "later"), [(0.0, 0), (0.04, 1), (0.1, 1), (0.75, 8), (2.0, 20)])
def test_an_order_comes_with_the_first_step_after_its_delay(delay, later):
    steps, found = ordered(OperatorLink(delay=delay), {3: [1.0], 4: [2.0]})
    assert steps == [3 + later, 4 + later]
    assert found == ordered(None, {3 + later: [1.0], 4 + later: [2.0]})[1]


def test_orders_wait_for_those_before_them():
    size = len('["Go", "", "", [2], {"speed": 1.0, "note": "go"}]')
    steps, _ = ordered(OperatorLink(delay=0.2, bandwidth=size / 0.3), {5: [1.0, 2.0, 3.0], 40: [4.0]})
    assert steps == [5 + 5, 5 + 8, 5 + 11, 40 + 5]


def test_which_orders_are_lost_is_drawn_from_the_seed():
    sends = {step: [1.0] * 10 for step in range(50)}
    lossy = OperatorLink(loss=0.3)
    steps, found = ordered(lossy, sends)
    assert 310 < len(steps) < 390
    assert (steps, found) == ordered(lossy, sends)
    assert steps != ordered(lossy, sends, seed=2)[0]
    assert ordered(OperatorLink(loss=1.0), sends)[0] == []


def test_what_came_over_the_link_is_played_again_without_it(tmp_path):
    link = OperatorLink(delay=0.4, loss=0.5, bandwidth=400.0)
    game = mission()
    with (
        Simulation(game, 3) as simulation,
        Recorder(simulation, tmp_path / "run") as recorder,
        Live(simulation, threaded=False, is_paused=True, link=link) as live,
    ):
        for step in range(12):
            live.publish(Go, receivers=[1 + step % 3], speed=float(step))
            live.set_parameter([1], "SingleIntegrator.max_speed", 50.0 + step)
            live.drive(3, (0.1 * step, 0.0, 0.0))
            live.step(3)
        live.drive(3, None)
        live.step(20)
        there = simulation.state_hash()
        live.seek(2.0)
        live.step(56 - live.step_number)
        assert simulation.state_hash() == there
        recorder.flush()
        inputs = load_inputs(tmp_path / "run")
        sticks = [each for each in live.injections if getattr(each, "type", None) is ManualControl]
        assert not any("another course" in note for note in live.notes)
        assert not sticks[-1].fields["is_on"], "that it is given back is never lost"
    assert 8 < len(inputs) < 36
    for seeds, world in (([3], 0), ([7, 3], 1)):
        with Simulation(game, seeds) as again:
            again.play_inputs(inputs, world)
            again.step(56)
            assert again.state_hash(world) == there


def test_a_jump_in_time_and_a_restart_lose_what_is_on_the_way():
    with linked(OperatorLink(delay=1.0)) as live:
        assert live.notes == ["orders take 1 s (--link)"]
        live.step(20)
        live.publish(Go, speed=1.0)
        live.step(5)
        live.seek(1.5)
        live.step(30)
        assert not live.injections
        assert "1 order on the way did not arrive: the time jumped from step 25 to 15" in live.notes
        live.publish(Go, speed=1.0)
        live.reset(4)
        live.step(20)
        assert not live.injections


def test_an_order_that_cannot_be_carried_out_when_it_comes_is_a_note():
    with linked(OperatorLink(delay=0.5)) as live:
        live.remove([2])
        live.step(2)
        live.set_parameter([2], "SingleIntegrator.max_speed", 5.0)
        live.step(10)
        assert live.step_number == 12
        assert any("has no entity 2 now" in note for note in live.notes)
        assert live.error is None


@pytest.mark.parametrize("link", [None, OperatorLink(delay=0.2, bandwidth=1e3)])
def test_objects_that_cannot_be_written_down_are_sent_as_others(link):
    with linked(link) as live:
        live.publish(Parcel, content={(1, 2): {object()}})
        live.step(10)
        assert live.error is None
        assert len(live.injections) == 1


def test_where_the_time_does_not_jump_orders_arrive():
    with linked(OperatorLink(delay=1.0)) as live:
        live.step(5)
        live.publish(Go, speed=1.0)
        live.step(5)
        live._player.timeline.refusal = "a plugin cannot be saved"
        live.seek(0.0)
        live.step(10)
        assert [each.step for each in live.injections] == [15]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("delya=1", "there is no 'delya' (did you mean 'delay'?); there are: delay, loss, bandwidth, see"),
        ("delay", "delay = '' is not a number"),
        ("delay=1,loss=x", "loss = 'x' is not a number"),
        ("loss=1.5", "loss = 1.5 is not allowed; it takes a number from 0 to 1"),
        ("delay=-1", "delay = -1.0 is not allowed"),
        ("bandwidth=0", "bandwidth = 0.0 is not allowed"),
        ("see=-1", "see = -1.0 is not allowed"),
        ("see=601", "see = 601.0 is not allowed"),
        ("delay=nan", "delay = nan is not allowed"),
        ("", "there is no ''"),
    ],
)
def test_a_link_that_is_none_is_refused(text, words):
    with pytest.raises(ParameterError) as caught:
        OperatorLink.of_text(text)
    assert words in str(caught.value)


def test_a_link_in_words():
    assert str(OperatorLink.of_text(" delay=0.5 , loss=0.1,bandwidth=200")) == (
        "orders take 0.5 s and share 200 bytes/s; 10 % of them are lost"
    )
    assert str(OperatorLink.of_text("see=1.5")) == "orders take 0 s; what is seen is 1.5 s old"


@pytest.mark.parametrize("threaded", [False, True])
def test_orders_keep_the_name_of_who_gave_them_on_the_way_and_after_a_seek(tmp_path, threaded):
    link = OperatorLink(delay=0.5)
    with (
        Simulation(mission(), 1) as simulation, Recorder(simulation, tmp_path / "run"),
        Live(simulation, threaded=threaded, is_paused=True, link=link) as live,
    ):  # fmt: skip
        with given_by("Ada"):
            live.publish(Go, receivers=[2], speed=4.0, note="go")
        live.drive(1, [1.0, 0.0, 0.0])
        with given_by("Ben"):
            live.publish(Go, receivers=[3], speed=5.0, note="go")
            live.drive(2, [0.0, 1.0, 0.0])
        live.step(10)
        while live.step_number < 10:
            time.sleep(0.01)
        live.seek(0.3)
        live.step(12)
        while live.step_number < 15:
            time.sleep(0.01)
    assert [each.by for each in load_inputs(tmp_path / "run")] == ["Ada", "", "Ben", "Ben"]


def watch(live, page, client):
    """Play a step on, and wait until the page has read it and shows what it is to show; returns the time that is shown [s]."""
    live.step()
    assert live.settle()
    now = float(live.simulation.t[0])
    client.wait(lambda: page.publisher._seen._kept[-1].t == now, 20.0)
    seen = max(now - live.see, 0.0)
    client.wait(lambda: abs(client.t - seen) < 1e-6 and abs(client.status.get("t", -1.0) - seen) < 1e-6, 20.0)
    return client.t


def test_what_people_see_is_late_in_the_time_of_the_game():
    with browsed(mission(), 1, is_paused=True, link=OperatorLink(see=0.5)) as (live, page, client):
        client.order("choose", id=2)
        client.wait(lambda: client.status.get("entity") and client.status["entity"]["sections"])
        live.publish(Go, receivers=[2], speed=5.0, note="go")
        assert watch(live, page, client) == 0.0
        start = client.frame[2].pos[0]
        for _ in range(4):
            assert watch(live, page, client) == 0.0
        assert live.frame().pos[1, 0] > start + 1.0  # the present, which nobody sees
        assert client.frame[2].pos[0] == start
        assert watch(live, page, client) == pytest.approx(0.1)
        assert watch(live, page, client) == pytest.approx(0.2)
        client.wait(lambda: client.status["step"] == 2)
        assert client.frame[2].pos[0] > start
        assert all(row[0] <= 0.2 for row in client.events)
        assert all(t <= 0.2 for changes in client.curves.values() for t, _ in changes)
        # Of an entity that is chosen now there is nothing to be seen yet, but it takes orders.
        client.order("choose", id=3)
        client.wait(lambda: client.status["entity"] and client.status["entity"]["id"] == 3)
        assert client.status["entity"]["sections"] == []
        assert client.status["entity"]["orders"]
        # A jump in time shows where it led to.
        client.order("seek", t=0.4)
        client.wait(lambda: abs(client.t - 0.4) < 1e-6)
        assert page.error is None


def test_the_end_of_a_game_is_seen_at_once_and_deaths_are_not_told_before():
    short = Mission(blocks=mission().blocks, dt=DT, end=3.0)
    with browsed(short, 1, is_paused=True, link=OperatorLink(see=2.0)) as (live, page, client):
        client.wait(lambda: client.frame)
        live.step(5)
        live.remove([1])
        for _ in range(5):
            live.step(2)
            assert live.settle()
            client.wait(lambda: client.n_frames)
        time.sleep(0.6)  # more than two statuses
        assert 1 not in live.frame().id
        assert 1 in client.frame
        assert not client.status["isOver"]
        assert not any("removed" in str(row) or row[1] == "death" for row in client.events)
        live.step(100)
        client.wait(lambda: client.status["isOver"])
        client.wait(lambda: 1 not in client.frame and abs(client.t - 3.0) < 1e-6)
        client.wait(lambda: any("death" in map(str, row) for row in client.events))
        assert page.error is None


def test_a_late_view_changes_neither_the_game_nor_its_recording(tmp_path):
    hashes = set()
    for name, see in (("now", 0.0), ("late", 1.0)):
        with (
            Simulation(mission(), 1) as simulation, Recorder(simulation, tmp_path / name),
            Live(simulation, is_paused=True, link=OperatorLink(delay=0.2, see=see)) as live,
            Page(live) as page, PageClient(page.url) as client,
        ):  # fmt: skip
            live.publish(Go, receivers=[2], speed=5.0, note="go")
            live.step(15)
            assert live.settle()
            client.wait(lambda: client.status)
            hashes.add(simulation.state_hash())
        hashes.add(str(load_inputs(tmp_path / name)))
    assert len(hashes) == 2


def moment(t, epoch=0, frame=None):
    return SeenMoment(t, round(t / DT), epoch, (0.0, t), False, frame, (), SeenDetails())


def test_moments_on_their_way_are_few_and_late_by_the_delay():
    seen, late = SeenGame(None), 7.0
    for k in range(5000):
        t = 0.01 * k
        seen.keep(moment(t), late)
        age = t - seen.now.t
        assert late <= age <= late * (1.0 + 1.0 / MAX_KEPT) + 0.011 or seen.now.t == 0.0
        assert len(seen._kept) <= MAX_KEPT + 2
    assert seen.now.t > 42.0
    seen.keep(moment(3.0, epoch=1), late)
    assert seen.now.t == 3.0
