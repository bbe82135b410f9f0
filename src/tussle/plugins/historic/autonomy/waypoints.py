"""Autonomies that make and follow waypoints, as in SCRIMMAGE."""

from __future__ import annotations

import numpy as np

from tussle.api import GroupView, Messages, State
from tussle.declare.messages import WAYPOINT_MODES
from tussle.plugins.stock.autonomy import waypoint_dispatcher, waypoint_generator


class WaypointGenerator(waypoint_generator.WaypointGenerator):
    """WaypointGenerator whose clock adds dt in each step, and so may reach the time of a waypoint one step late by rounding.

    tussle's time is start + k dt, and a waypoint is due at the step next to its time.
    """

    clock = State(unit="s", doc="Sum of the steps since the start.")

    def spawn(self, g: GroupView, rows: np.ndarray) -> None:
        for row, n_steps in zip(rows, g.step_count[rows], strict=True):
            self.clock[row] = np.cumsum([g.context.clock.start, *[g.dt] * n_steps])[-1]

    def _now(self, g: GroupView) -> np.ndarray:
        now: np.ndarray = self.clock.copy()
        self.clock[:] += g.dt
        return now


FOLLOW_ONCE, BACK_AND_FORTH, LOITER, RACETRACK = range(len(WAYPOINT_MODES))


class WaypointDispatcher(waypoint_dispatcher.WaypointDispatcher):
    """WaypointDispatcher that stays one step longer at the turning points of back_and_forth, and cannot loiter.

    A vehicle that leaves the tolerance of a turning point in that step flies back to it. With loiter the list is flown once. The status
    is published in every step within the tolerance of the last waypoint. A waypoint is reached only within the tolerance at the end of a
    step; in tussle also if it is passed between two steps. None is skipped.
    """

    def _way_begin(self, g: GroupView) -> np.ndarray:
        return np.asarray(g.pos)

    def _skip(self, rows: np.ndarray, begin: np.ndarray, end: np.ndarray) -> None:
        """Skip none, whatever `max_turns` is."""

    def _start_lists(self, rows: np.ndarray, messages: Messages) -> None:
        super()._start_lists(rows, messages)
        self.mode[rows] = np.where(self.mode[rows] == LOITER, FOLLOW_ONCE, self.mode[rows])

    def _advance(self, rows: np.ndarray, is_skipped: bool = False) -> None:
        n_points = self.points.count[rows]
        mode, here, back = self.mode[rows], self.current[rows], self.is_returning[rows]
        turns = (mode == BACK_AND_FORTH) & np.where(back, here == 0, here + 1 == n_points)
        ends = (mode == FOLLOW_ONCE) & (here + 1 == n_points)
        after = np.where(mode == RACETRACK, (here + 1) % n_points, here + np.where(back, -1, 1))
        self.previous[rows], self.current[rows] = here, np.where(turns | ends, here, after)
        self.is_returning[rows], self.is_done[rows] = back ^ turns, ends
        self.status.publish(
            rows, index=self.current[rows], n_waypoints=n_points, is_done=ends, is_skipped=is_skipped
        )
