"""Closest point of approach."""

from __future__ import annotations

import numpy as np

from tussle.api import HistoricAttributes, Metric, Param, State, WorldView


class CPA(Metric):
    """Closest point of approach of each team: the smallest distance to another entity in the run, the two entities, and the time.

    Distances are measured after the motion of each step. With `team_cpa` or a `team_id` only distances to team mates count, with a
    `team_id` only entities of that team. SCRIMMAGE wrote the smallest distance of each entity to a file and reported no
    metric; here the columns `closest`, `other` and `when` hold it for living entities. Times are those of the measurement (in
    SCRIMMAGE, of the start of the step).
    """

    grade = "portable"
    named_teams = ("team_id",)
    historic_attributes = HistoricAttributes(unread=("ground_collisions",))

    team_cpa = Param(False, structural=True, doc="Measure distances to team mates only.")
    team_id = Param(0, structural=True, doc="If > 0, measure entities of this team only.")
    min_time_s = Param(-1.0, unit="s", doc="Start of the measurement; negative for no limit.")
    max_time_s = Param(-1.0, unit="s", doc="End of the measurement; 0 or negative for no limit.")
    cpa = State(unit="m", default=np.inf, per="team", doc="Smallest distance so far; infinite if none.")
    cpa_entity = State(dtype=int, per="team", doc="Id of the team's entity at `cpa`; 0 if none.")
    cpa_other = State(dtype=int, per="team", doc="Id of the other entity at `cpa`.")
    cpa_time = State(unit="s", per="team", doc="Time of `cpa`.")
    closest = State(unit="m", default=np.inf, per="entity", doc="Smallest distance of the entity so far.")
    other = State(dtype=int, per="entity", doc="Id of the other entity at `closest`.")
    when = State(unit="s", per="entity", doc="Time of `closest`.")

    def step(self, w: WorldView) -> None:
        t = self._now(w)
        slack = 1e-6 * w.dt
        is_due = (t >= self.min_time_s - slack) & ((self.max_time_s <= 0.0) | (t <= self.max_time_s + slack))
        if not is_due.any():
            return
        nearest = w.nearest(teams="own" if self.team_cpa or self.team_id > 0 else None)
        other, distance = nearest.other[0], nearest.distance[0]
        is_nearer = is_due[w.world] & (other >= 0) & (distance < self.closest)
        if self.team_id > 0:
            is_nearer &= w.team == self.team_id
        rows = np.flatnonzero(is_nearer)
        if len(rows):
            self.closest[rows] = distance[rows]
            self.other[rows] = w.id[other[rows]]
            self.when[rows] = t[w.world[rows]]
            self._compare(w, rows)

    def _now(self, w: WorldView) -> np.ndarray:
        """Time of the distances [s], (n_worlds,)."""
        return w.t

    def _compare(self, w: WorldView, rows: np.ndarray) -> None:
        """Update the teams' columns with new smallest distances; on ties the smaller id is taken."""
        team, world = w.team_numbers(w.team[rows]), w.world[rows]
        is_record = self.closest[rows] < self.cpa[team, world]
        rows, team, world = rows[is_record], team[is_record], world[is_record]
        order = np.lexsort((w.id[rows], self.closest[rows], world, team))
        rows, team, world = rows[order], team[order], world[order]
        is_first = np.ones(len(rows), bool)
        is_first[1:] = (team[1:] != team[:-1]) | (world[1:] != world[:-1])
        rows, at = rows[is_first], (team[is_first], world[is_first])
        self.cpa[at], self.cpa_time[at] = self.closest[rows], self.when[rows]
        self.cpa_entity[at], self.cpa_other[at] = w.id[rows], self.other[rows]

    def result(self, w: WorldView) -> dict[str, np.ndarray]:
        return {
            "cpa": self.cpa,
            "cpa_entity": self.cpa_entity,
            "cpa_other": self.cpa_other,
            "cpa_time": self.cpa_time,
        }
