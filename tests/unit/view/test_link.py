"""Orders that come over a slow link that loses some."""

import time

import pytest

from tussle import Block, Mission, Recorder, Simulation
from tussle.api import Autonomy, Field, Handle, Message, Output, State, Subscribe
from tussle.errors import ParameterError
from tussle.messages import ManualControl
from tussle.record import given_by, load_inputs
from tussle.stock import SingleIntegrator
from tussle.view import Live, OperatorLink

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


def ordered(link, sends, n_steps=60, seed=1):
    """Steps at which orders came, and the hash at the end. `sends` maps steps to speeds, sent to robot 2."""
    with (
        Simulation(mission(), seed) as simulation,
        Live(simulation, threaded=False, is_paused=True, link=link) as live,
    ):
        for step in range(n_steps):
            for speed in sends.get(step, ()):
                live.publish(Go, receivers=[2], speed=speed, note="go")
            live.step(1)
        return [each.step for each in live.injections], simulation.state_hash()


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
    link = OperatorLink(delay=1.0)
    with (
        Simulation(mission(), 1) as simulation,
        Live(simulation, threaded=False, is_paused=True, link=link) as live,
    ):
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
    link = OperatorLink(delay=0.5)
    with (
        Simulation(mission(), 1) as simulation,
        Live(simulation, threaded=False, is_paused=True, link=link) as live,
    ):
        live.remove([2])
        live.step(2)
        live.set_parameter([2], "SingleIntegrator.max_speed", 5.0)
        live.step(10)
        assert live.step_number == 12
        assert any("has no entity 2 now" in note for note in live.notes)
        assert live.error is None


@pytest.mark.parametrize("link", [None, OperatorLink(delay=0.2, bandwidth=1e3)])
def test_objects_that_cannot_be_written_down_are_sent_as_others(link):
    with (
        Simulation(mission(), 1) as simulation,
        Live(simulation, threaded=False, is_paused=True, link=link) as live,
    ):
        live.publish(Parcel, content={(1, 2): {object()}})
        live.step(10)
        assert live.error is None
        assert len(live.injections) == 1


def test_where_the_time_does_not_jump_orders_arrive():
    link = OperatorLink(delay=1.0)
    with (
        Simulation(mission(), 1) as simulation,
        Live(simulation, threaded=False, is_paused=True, link=link) as live,
    ):
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
        ("delya=1", "there is no 'delya' (did you mean 'delay'?); there are: delay, loss, bandwidth"),
        ("delay", "delay = '' is not a number"),
        ("delay=1,loss=x", "loss = 'x' is not a number"),
        ("loss=1.5", "loss = 1.5 is not allowed; it takes a number from 0 to 1"),
        ("delay=-1", "delay = -1.0 is not allowed"),
        ("bandwidth=0", "bandwidth = 0.0 is not allowed"),
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
