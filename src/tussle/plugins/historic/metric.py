"""Metrics with the laws of SCRIMMAGE."""

from __future__ import annotations

import numpy as np

from tussle.api import State, WorldView
from tussle.plugins.stock.metric import cpa, simple_capture_metrics, simple_collision_metrics


class CPA(cpa.CPA):
    """CPA whose times are those of the start of the step, though the distances are those of its end."""

    def _now(self, w: WorldView) -> np.ndarray:
        return w.t - w.context.clock.dt


class SimpleCaptureMetrics(simple_capture_metrics.SimpleCaptureMetrics):
    """SimpleCaptureMetrics that counts no captures by teams which first appear after the first step."""

    is_listed = State(dtype=bool, per="team", doc="Whether the team was there in the first step.")

    def step(self, w: WorldView) -> None:
        is_first = w.step_count[w.world] == 0
        self.is_listed[w.team_numbers(w.team[is_first]), w.world[is_first]] = True
        super().step(w)

    def result(self, w: WorldView) -> dict[str, np.ndarray]:
        return {name: np.where(self.is_listed, count, 0) for name, count in super().result(w).items()}


class SimpleCollisionMetrics(simple_collision_metrics.SimpleCollisionMetrics):
    """SimpleCollisionMetrics whose survivors are credited up to the last removal of the run, and that ends all times a step early.

    An entity flies from the start of the step in which it appears to the start of the step in which it is removed. Survivors, and those
    removed in the step in which they appeared, fly to the last of these ends; if there is none, to the start of the last step. A team
    that first appears after the first step has an infinite flight_time_norm and the score NaN.
    """

    calls = State(dtype=int, per="entity", doc="Steps of the entity so far.")
    began = State(dtype=int, per="entity", doc="Step in which it appeared.")
    n_later = State(dtype=int, per="team", doc="Steps of all entities without the first one of each.")
    n_twice = State(dtype=int, per="team", doc="Entities that have flown two steps.")
    began_all = State(dtype=int, per="team", doc="Sum of the steps in which entities appeared.")
    began_twice = State(dtype=int, per="team", doc="The same of those that have flown two steps.")
    n_alive = State(dtype=int, per="world", doc="Living entities at the end of the last step.")
    last_end = State(dtype=int, per="world", default=-1, doc="Step of the last removal; -1 before.")
    is_listed = State(dtype=bool, per="team", doc="Whether the team was there in the first step.")

    def step(self, w: WorldView) -> None:
        self.last_end[:] = self._last_end(w, w.step_count - 1)
        fresh = self.calls == 0
        self.began[fresh] = w.step_count[w.world[fresh]]
        super().step(w)
        self.calls[:] += 1
        self.n_later[:] += _by_team(w, self.calls > 1)
        self.n_twice[:] += _by_team(w, self.calls == 2)
        self.began_all[:] += _by_team(w, self.began * fresh)
        self.began_twice[:] += _by_team(w, self.began * (self.calls == 2))
        self.is_listed[:] |= (_by_team(w, fresh) > 0) & (w.step_count == 0)
        self.n_alive[:] = np.bincount(w.world, minlength=w.n_worlds)

    def _last_end(self, w: WorldView, step: np.ndarray) -> np.ndarray:
        """Step of the last removal, (n_worlds,), if those since the last call were in the steps (n_worlds,)."""
        left = np.bincount(w.world[self.calls > 0], minlength=w.n_worlds)
        return np.where(left < self.n_alive, step, self.last_end)

    def result(self, w: WorldView) -> dict[str, np.ndarray]:
        dt, final, first = w.context.clock.dt, w.step_count - 1, np.maximum(self.first_step, 0)
        last = self._last_end(w, final)
        end = np.where(last > first, last, final)
        is_early = self.calls < 2
        n_early = self.n_entities - self.n_twice - _by_team(w, is_early)
        began_early = self.began_all - self.began_twice - _by_team(w, self.began * is_early)
        of_removed = self.n_later - _by_team(w, np.maximum(self.calls - 1, 0)) + n_early * end - began_early
        flight_time = (of_removed + _by_team(w, end[w.world] - self.began)) * dt
        with np.errstate(divide="ignore", invalid="ignore"):
            norm = flight_time / np.where(self.is_listed, (end - first) * dt, 0.0)
            norm = np.where(self.n_entities > 0, norm, 0.0)
            score = self.flight_time_w * norm
        score += self.team_collisions_w * self.n_team + self.non_team_collisions_w * self.n_non_team
        changed = {"flight_time": flight_time, "flight_time_norm": norm, "score": score}
        return {**super().result(w), **changed}


def _by_team(w: WorldView, amount: np.ndarray) -> np.ndarray:
    """Sum of amounts per row, (n,), by team and world, (n_teams, n_worlds)."""
    out = np.zeros((len(w.teams), w.n_worlds), np.int64)
    np.add.at(out, (w.team_numbers(w.team), w.world), amount)
    return out
