"""The closest point of approach."""

from __future__ import annotations

import numpy as np

from tussle.api import HistoricAttributes, Metric, Param, State, WorldView


class CPA(Metric):
    """How near entities of each team have come to another: the least distance of the run, between whom, and when.

    Looked at after each step's motion. With `team_cpa` or a `team_id` only the others of the own team count, with a `team_id` only
    entities of that team. The existing system wrote the least distance of each entity into a file of its own and reported nothing;
    the columns `closest`, `other` and `when` hold that for entities that live. Times are those at which the distance was so (there,
    those of the step's beginning).
    """

    grade = "portable"
    historic_attributes = HistoricAttributes(unread=("ground_collisions",))

    team_cpa = Param(False, structural=True, doc="Only team mates count.")
    team_id = Param(0, structural=True, doc="Only entities of this team, when > 0.")
    min_time_s = Param(-1.0, unit="s", doc="Look from this time on; negative is always.")
    max_time_s = Param(-1.0, unit="s", doc="Look up to this time; 0 or negative is always.")
    cpa = State(
        unit="m", default=np.inf, per="team", doc="Least distance so far; infinite before there is one."
    )
    cpa_entity = State(dtype=int, per="team", doc="Id of the team's entity that was so near; 0 is none.")
    cpa_other = State(dtype=int, per="team", doc="Id of the other.")
    cpa_time = State(unit="s", per="team", doc="When.")
    closest = State(unit="m", default=np.inf, per="entity", doc="Least distance of an entity so far.")
    other = State(dtype=int, per="entity", doc="Id of the other.")
    when = State(unit="s", per="entity", doc="When.")

    def step(self, w: WorldView) -> None:
        t = w.t
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

    def _compare(self, w: WorldView, rows: np.ndarray) -> None:
        """Take over into the teams' columns what is nearer than anything before; of equals the smaller id."""
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
