"""Plays a game and executes the orders of its viewers between steps."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

from tussle.errors import PluginError, TussleError
from tussle.pacing import Pace
from tussle.view.drawn import DrawCollector
from tussle.view.pacing import Speedometer
from tussle.view.player import Player

MAX_WAIT = 60.0
"""Time for which it sleeps at once [s]: no clock of the system counts to the next step of a game that is all but stopped."""
BURST = 0.004
"""Time for which steps are made before anything else is looked after [s]: short against the 33 ms between two frames."""


@dataclass(frozen=True, eq=False)
class Order:
    """An order to be executed between two steps.

    Attributes:
        do: Does it.
        is_seek: It goes to a place in time, so that a later one makes it pointless.
        may_cut_in: It need not wait until those before have got where they go.
    """

    do: Callable[[], None]
    is_seek: bool = False
    may_cut_in: bool = False


class PlaybackController:
    """Plays a game and executes orders, in a thread of its own or in the caller's.

    Args:
        player: The game.
        pace: How fast it is played.
        collector: Shapes that its plugins draw.
        is_paused: Start paused.
        on_moment: Called with whether playback is paused: every few ms between steps, and when it pauses.

    Attributes:
        is_paused: It stands still when all orders are carried out.
        error: What stopped the game.
        version: Counts changes of what there is to be seen.
        epoch: Counts jumps in time.
        shown: Step of what is to be seen, and whether the world is over there: during a seek, that where it began.
    """

    def __init__(
        self,
        player: Player,
        pace: Pace,
        collector: DrawCollector,
        is_paused: bool,
        on_moment: Callable[[bool], None],
    ) -> None:
        self.player, self.pace, self.collector = player, pace, collector
        self.speed = Speedometer()
        self.is_paused = is_paused
        self.error: BaseException | None = None
        self.version = self.epoch = 0
        self.shown = player.step, player.is_over
        self._on_moment = on_moment
        self._orders: deque[Order] = deque()
        self._goal: int | None = None
        self._is_going = False
        self._wait: float | None = None
        self._bell = threading.Event()
        self._is_stopping = False

    # -- from any thread --------------------------------------------------------------------------------------------------------

    def give(self, order: Order) -> None:
        """Queue an order."""
        if order.is_seek:
            for other in list(self._orders):
                if other.is_seek:
                    self._take_back(other)
        self._orders.append(order)
        self._bell.set()

    def _take_back(self, order: Order) -> None:
        with suppress(ValueError):  # it has been taken up meanwhile
            self._orders.remove(order)

    def ring(self) -> None:
        """Wake the playing thread."""
        self._bell.set()

    def end(self) -> None:
        """Make `run` return after the current step."""
        self._is_stopping = True
        self._bell.set()

    @property
    def is_seeking(self) -> bool:
        """True if steps are being replayed on the way to another time."""
        return self._is_going and self.player.step < self.player.last_step

    # -- the loop -----------------------------------------------------------------------------------------------------------------

    def run(self) -> None:
        """Execute orders and play, until `end`."""
        while not self._is_stopping:
            self._bell.clear()
            has_worked = self.work(may_play=True)
            self._on_moment(not has_worked and self._wait is None)
            if not has_worked:
                self._sleep()

    def _sleep(self) -> None:
        began = time.perf_counter()
        self._bell.wait(None if self._wait is None else min(self._wait, MAX_WAIT))
        self.player.rest(time.perf_counter() - began)

    def follow(self) -> None:
        """Show the state after steps that the caller made, execute orders, and wait while the game is paused or too fast."""
        player, clock = self.player, self.player.simulation.state.context.clock
        if player.catch_up():
            self._goal = None
            self.epoch += 1
            self.collector.clear()
            self.pace.restart()
            self.speed.restart()
        self._changed()
        t = float(clock.start + player.step * clock.dt)
        self.speed.read(t, player.step)
        while not self._is_stopping:
            self._bell.clear()
            if self._orders:
                self._carry_out(self._orders.popleft())
            elif self._goal is not None and player.step < self._goal:
                break
            else:
                self._goal, self._wait = None, None
                if self.is_paused:
                    self.pace.restart()
                    self.speed.restart()
                else:
                    self._wait = self.pace.wait(t, clock.dt)
                    if self._wait <= 0.0:
                        break
                self._on_moment(self.is_paused)
                self._sleep()
        self._on_moment(False)
        if self.collector.is_open:
            self.collector.begin_step()

    def drain(self) -> None:
        """Execute all queued orders."""
        while self.work(may_play=False):
            pass

    def work(self, may_play: bool) -> bool:
        """Execute the next order or step; return False if there is none."""
        self._wait = None
        if self._orders and (self._goal is None or self._orders[0].may_cut_in):
            self._carry_out(self._orders.popleft())
        elif self._goal is not None:
            self._advance_to(self._goal)
        elif may_play and not self.is_paused and not self.player.is_over:
            return self._play()
        else:
            self.pace.restart()
            self.speed.restart()
            return False
        return True

    def _carry_out(self, order: Order) -> None:
        try:
            order.do()
        except (Exception, KeyboardInterrupt) as error:  # noqa: BLE001 - whatever it is, whoever watches reads it, and nothing hangs
            if isinstance(error, TussleError) and not isinstance(error, PluginError):
                self.player.note(str(error))
            else:
                self._fail(error)
        self._changed()

    def _play(self) -> bool:
        player = self.player
        clock = player.simulation.state.context.clock
        until = time.perf_counter() + BURST
        while True:
            left = self.pace.wait(float(clock.start + player.step * clock.dt), clock.dt)
            if left > 0.0:
                self._wait = left
                return False
            self._advance()
            self.speed.read(float(clock.start + player.step * clock.dt), player.step)
            if player.is_over or self._orders or self.is_paused or time.perf_counter() > until:
                return True

    def _advance_to(self, goal: int) -> None:
        until = time.perf_counter() + BURST
        while self.player.step < goal and not self.player.is_over:
            self._advance()
            if self._orders or self._is_stopping or time.perf_counter() > until:
                break
        if self.player.step >= goal or self.player.is_over:
            self._goal, self._is_going = None, False
            self.pace.restart()
            self._changed()

    def _advance(self) -> None:
        if self.collector.is_open:
            self.collector.begin_step()
        try:
            self.player.advance()
        except (Exception, KeyboardInterrupt) as error:  # noqa: BLE001 - whatever a plugin does, whoever watches reads it
            self._fail(error)
        self._changed()

    def _fail(self, error: BaseException) -> None:
        self.error, self.is_paused, self.player.is_broken = error, True, True
        self._goal, self._is_going = None, False

    def _changed(self) -> None:
        if not self.is_seeking:
            self.version += 1
            self.shown = self.player.step, self.player.is_over

    # -- orders -------------------------------------------------------------------------------------------------------------------

    def move(self, n: int) -> None:
        """Advance n steps, or go back -n."""
        if n < 0:
            self.go(self.player.step + n)
        else:
            self._goal = self.player.step + n

    def go(self, step: int) -> None:
        """Go to an earlier or later step."""
        was_broken = self.player.is_broken
        self._is_going = True
        self._goal = self.player.wind(step)
        self.epoch += 1
        self.collector.clear()
        if was_broken and not self.player.is_broken:
            self.error = None

    def begin_anew(self, seed: int | None) -> None:
        """Restart, with another seed if one is given."""
        self._goal, self._is_going, self.error = None, False, None
        self.epoch += 1
        self.collector.clear()
        self.player.reset(seed)
        self.pace.restart()
        self.speed.restart()
