"""Pace, speed, allowance and offers, on a clock that the test moves."""

import pytest

from tussle import pacing as paces
from tussle.errors import ParameterError
from tussle.pacing import MAX_LAG, Pace
from tussle.view import latest, pacing
from tussle.view.latest import LINGER, LatestValue
from tussle.view.pacing import Allowance, Speedometer, checked_warp, faster, slower


class Clock:
    def __init__(self):
        self.now = 100.0

    def perf_counter(self):
        return self.now

    monotonic = thread_time = perf_counter

    def sleep(self, seconds):
        self.now += seconds


@pytest.fixture
def clock(monkeypatch):
    clock = Clock()
    monkeypatch.setattr(pacing, "time", clock)
    monkeypatch.setattr(paces, "time", clock)
    monkeypatch.setattr(latest, "time", clock)
    return clock


def play(pace, clock, seconds, cost=0.001):
    """Make steps of 0.1 s as they become due; how many."""
    step, until = 0, clock.now + seconds
    while clock.now < until:
        wait = pace.wait(step * 0.1, 0.1)
        if wait > 0.0:
            clock.now += wait
        else:
            clock.now += cost
            step += 1
    return step


@pytest.mark.parametrize(
    ("warp", "cost", "steps"), [(1.0, 0.001, 100), (0.5, 0.001, 50), (20.0, 0.001, 2000), (1e9, 0.01, 1000)]
)
def test_steps_are_made_when_they_are_due(clock, warp, cost, steps):
    assert play(Pace(warp), clock, 10.0, cost) == pytest.approx(steps, abs=2)


def test_a_paced_loop_is_neither_early_nor_hurries_after_a_long_stop(clock):
    pace, began = Pace(2.0), clock.now
    for step in range(1, 101):
        pace.hold(0.1 * step, 0.1, lambda: False)
    assert clock.now - began == pytest.approx(99 * 0.05)
    clock.now += 60.0  # the machine slept
    stopped = clock.now
    for step in range(101, 201):
        pace.hold(0.1 * step, 0.1, lambda: False)
    assert 5.0 - MAX_LAG - 0.1 <= clock.now - stopped <= 5.0


def test_a_jump_of_simulated_time_is_not_waited_for(clock):
    pace, began = Pace(1.0), clock.now
    for t in (0.1, 0.2, 500.0, 500.1, 3.0, 3.1):
        pace.hold(t, 0.1, lambda: False)
    assert clock.now - began == pytest.approx(0.3)


def test_an_interruption_ends_the_wait(clock):
    pace, began = Pace(0.001), clock.now
    pace.hold(1.0, 1.0, lambda: False)
    pace.hold(2.0, 1.0, lambda: clock.now - began > 1.0)
    assert clock.now - began == pytest.approx(1.0, abs=0.1)


def test_a_game_that_is_late_makes_up_for_little_only(clock):
    pace = Pace(1.0)
    assert pace.wait(0.0, 0.1) == pytest.approx(0.1)
    clock.now += 5.0
    late = 0
    while pace.wait(late * 0.1, 0.1) <= 0.0:
        late += 1
    assert late <= 4
    clock.now += 0.1
    assert pace.wait(late * 0.1, 0.1) <= 0.0


def test_a_change_of_pace_counts_from_then_on(clock):
    pace = Pace(1.0)
    pace.wait(0.0, 0.1)
    clock.now += 0.1
    pace.warp = 0.1
    pace.restart()
    assert pace.wait(0.1, 0.1) == pytest.approx(1.0)
    pace.warp = float("inf")
    assert pace.wait(0.1, 0.1) == 0.0


def test_speed_is_that_of_the_last_second(clock):
    speed = Speedometer()
    assert speed.speed() == (0.0, 0.0)
    for k in range(1000):
        clock.now += 0.01
        speed.read(k * 0.02 if k < 500 else 10.0 + (k - 500) * 0.05, k)
        if k == 400:
            assert speed.speed() == pytest.approx((2.0, 100.0), rel=1e-3)
    assert speed.speed() == pytest.approx((5.0, 100.0), rel=1e-3)
    speed.restart()
    assert speed.speed() == (0.0, 0.0)


def test_an_allowance_is_a_share_of_the_time(clock):
    allowance, spent, began = Allowance(0.02), 0.0, clock.now
    for _ in range(100_000):
        clock.now += 0.001
        if allowance.allows():
            allowance.pay(0.005)
            clock.now += 0.005
            spent += 0.005
    assert spent / (clock.now - began) == pytest.approx(0.02, rel=0.05)
    allowance.rest(3600.0)  # an hour's pause buys no hour of snapshots
    bought = 0
    while allowance.allows():
        allowance.pay(0.005)
        bought += 1
    assert bought <= 8


def test_rest_counts_and_the_clock_of_another_thread_does_not(clock):
    allowance = Allowance(0.02)
    allowance.pay(0.02)
    clock.now -= 50.0
    assert not allowance.allows()
    allowance.rest(1.7)
    assert not allowance.allows()
    allowance.rest(0.2)
    assert allowance.allows()


def test_warps():
    assert checked_warp(None) == float("inf")
    assert checked_warp(3) == 3.0
    for wrong in (0, -1.0, float("nan"), "1", True):
        with pytest.raises(ParameterError, match="takes a number > 0"):
            checked_warp(wrong)
    assert faster(1.5) == 3.0
    assert slower(2.5, 0.0) == 1.5
    assert slower(float("inf"), 37.9) == 37.0


def test_an_offer_is_made_while_asked_for_and_no_oftener_than_its_period(clock):
    made, rung = [], []
    offer = LatestValue(lambda: made.append(clock.now) or len(made), 0.1, lambda: rung.append(1))
    for version in range(100):
        clock.now += 0.01
        offer.renew(version)
    assert made == []
    assert offer.take() is None
    assert rung == [1]
    for version in range(100, 200):
        clock.now += 0.01
        offer.take()
        offer.renew(version)
    assert 9 <= len(made) <= 11
    assert offer.take() == len(made)
    n = len(made)
    for version in range(200, 400):  # nobody asks any more
        clock.now += 0.01
        offer.renew(version)
    assert len(made) - n <= LINGER / 0.1 + 1
    n = len(made)
    offer.renew(401, is_still=True)
    assert len(made) == n
    offer.renew(401, is_still=True, always=True)
    offer.renew(401, is_still=True, always=True)
    assert len(made) == n + 1
    offer.take()
    offer.renew(402, is_still=True)  # nothing else will come: no need to wait for the period
    assert len(made) == n + 2


def test_an_offer_that_takes_long_leaves_the_game_most_of_the_time(clock):
    def make():
        clock.now += 1.0

    offer = LatestValue(make, 0.1, lambda: None)
    began = clock.now
    for version in range(4000):
        clock.now += 0.01
        offer.take()
        offer.renew(version)
    assert 3 <= offer.n_made <= 0.25 * (clock.now - began) + 1
