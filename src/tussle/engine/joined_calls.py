"""Calls of plugins that only call kernels, joined into one call of machine code while rows and parameters stay the same."""

from __future__ import annotations

from bisect import bisect
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from tussle.api.group import GroupView
from tussle.api.motion import WRITABLE
from tussle.engine import failure
from tussle.engine.calls import Call
from tussle.engine.state import SimulationState
from tussle.errors import PluginError
from tussle.numeric.replay import Replay, are_same, may_be_repeated, recording

WORTH = 20.0
"""Number of steps for which rows stay the same on average, from which on it is worth packing arguments early."""
AFTER_LAWS = 2
"""Steps after which calls are joined, beyond those of `Context.steady`, after which the pair loop of a law is one kernel."""


@dataclass(slots=True)
class Joined:
    """Calls as machine code.

    Attributes:
        replay: All kernels.
        ends: Number of kernels up to the end of each call.
        later: For each call, what Python does after its kernels: view, plugin and function.
        callers: For each call, its view and plugin.
    """

    replay: Replay
    ends: list[int]
    later: list[list[tuple[GroupView, object, Callable[[], None]]]]
    callers: list[tuple[GroupView, object]]


class JoinedCalls:
    """Consecutive calls of a schedule that end with a motion model.

    While rows stay the same, each step calls the same kernels with the same arguments. They are recorded in two steps, in which
    all that is kept for the current positions is computed again, and called by `Replay` from then on. Where the second step's
    arguments are others, the calls are not joined. Once they have been the same, one step is recorded whenever rows have changed.
    """

    def __init__(self, state: SimulationState, calls: Sequence[Call]) -> None:
        self.state, self.calls = state, calls
        self.views = list(dict.fromkeys(view for call in calls for view in call.views))
        self.n_steps = self.n_refused = self.wait = 0
        self.mean_steps = 0.0
        self.recorded: list[tuple[Any, ...]] = []
        self.is_known = False

    def run(self) -> None:
        """Run the calls."""
        kept = self.views[0].kept.get(self)
        if kept is None or not all(self in view.kept for view in self.views):
            self._begin(self.n_steps)
        self.n_steps += 1
        if kept.__class__ is Joined and self.n_steps > 1:
            self._replay(kept)
        elif self.wait <= self.n_steps <= self.wait + 1:
            self._record()
        else:
            for call in self.calls:
                call.run()

    def _begin(self, n_steps: int) -> None:
        """Begin anew after rows or parameters have changed, which stayed the same for a number of steps."""
        context = self.state.context
        self.mean_steps = 0.5 * (self.mean_steps + n_steps)
        context.steady = context.steady_steps[self.mean_steps < WORTH]
        self.wait = (context.steady + AFTER_LAWS) * 2**self.n_refused
        self.n_steps = 0
        for view in self.views:
            view.kept[self] = True

    def _replay(self, joined: Joined) -> None:
        try:
            done = joined.replay.run()
        except Exception as error:
            view, plugin = joined.callers[bisect(joined.ends, int(joined.replay.at[0]))]
            raise self._failed(error, plugin, view) from error
        bodies = self.state.population.bodies
        bodies.touch(0, bodies.n)
        for end, later, call in zip(joined.ends, joined.later, self.calls, strict=True):
            if end > done:
                call.run()
                continue
            for view, plugin, function in later:
                view._caller = plugin
                try:
                    function()
                except Exception as error:
                    raise self._failed(error, plugin, view) from error

    def _failed(self, error: Exception, plugin: object, view: GroupView) -> PluginError:
        group = next(g for g in self.state.population.groups if view in g.views)
        return failure.in_call(error, plugin, view, group)

    def _columns(self) -> list[np.ndarray]:
        """The arrays that plugins of the calls may change, by kernels; looked at until two steps have agreed, since that takes time."""
        groups = [g for g in self.state.population.groups if any(view in self.views for view in g.views)]
        moved = [getattr(g.motion_view, name) for g in groups for name in WRITABLE]
        return moved + [
            b.plugin.__dict__[k] for g in groups for b in g.walk() for k in b.places if k in b.writable
        ]

    def _record(self) -> None:
        bodies, context = self.state.population.bodies, self.state.context
        bodies.touch(0, bodies.n)
        ends, later, callers = [], [], []
        try:
            with recording([] if self.is_known else self._columns()) as recorded:
                for call in self.calls:
                    context.later = []
                    call.run()
                    ends.append(len(recorded.calls))
                    later.append(context.later)
                    callers.append((call.views[0], call.views[0]._caller))
        except PluginError as error:
            if isinstance(error.cause, ValueError) and "read-only" in str(error.cause):
                promise = f"{error.plugin} promises only_calls_kernels, but changes a column without a kernel"
                error.message = f"{promise}: {error.message}"
            raise
        finally:
            context.later = None
        before, self.recorded = self.recorded, recorded.calls
        calls, is_first = recorded.calls, self.n_steps == self.wait and not self.is_known
        are_repeatable = all(
            may_be_repeated(calls[a:b], "motion" in call.names)
            for (a, b), call in zip(pairwise([0, *ends]), self.calls, strict=True)
        )
        self.is_known = self.is_known or (not is_first and are_same(before, calls))
        if not (recorded.is_whole and calls and are_repeatable and (is_first or self.is_known)):
            self.n_refused += 1
            self.wait *= 2
        elif not is_first:
            self.views[0].kept[self] = Joined(Replay(calls), ends, later, callers)
            self.n_refused = 0


def joined(state: SimulationState, calls: Sequence[Call]) -> list[Callable[[], None]]:
    """Return the functions of a step: those of the calls, or one for several of them."""
    functions: list[Callable[[], None]] = []
    first = 0
    while first < len(calls):
        last = first
        for k in range(first, len(calls)):
            if not calls[k].views:
                break
            if "motion" in calls[k].names:
                last = k + 1
        if last - first > 1:
            functions.append(JoinedCalls(state, calls[first:last]).run)
        else:
            last = first + 1
            functions.append(calls[first].run)
        first = last
    return functions
