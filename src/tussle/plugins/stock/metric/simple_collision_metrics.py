"""Collision counts and flight time."""

from __future__ import annotations

import numpy as np

from tussle.api import Metric, Param, State, WorldView
from tussle.declare.messages import EntityCollided, EntityHitGround


class SimpleCollisionMetrics(Metric):
    """Counts collisions with team mates, other teams and the ground, and sums the flight time, by team.

    A collision counts once for each of the two entities. The flight time of an entity ends with the step in which it is removed or
    with the run; flight_time_norm is the team's sum divided by the time since the first entity appeared. The score is the weighted
    sum of flight_time_norm, team collisions and non-team collisions.

    In SCRIMMAGE survivors were not credited beyond the last removal of the run, flight times ended one step early, and
    a team that appeared after the first step scored NaN.
    """

    grade = "portable"

    flight_time_w = Param(0.0, doc="Score per flight_time_norm.")
    team_collisions_w = Param(-1.0, doc="Score per collision with a team mate.")
    non_team_collisions_w = Param(-1.0, doc="Score per collision with an entity of another team.")
    n_entities = State(dtype=int, per="team", doc="Entities counted so far.")
    n_steps = State(dtype=int, per="team", doc="Steps flown, summed over all entities.")
    n_team = State(dtype=int, per="team", doc="Collisions with team mates.")
    n_non_team = State(dtype=int, per="team", doc="Collisions with entities of other teams.")
    n_ground = State(dtype=int, per="team", doc="Collisions with the ground.")
    first_step = State(dtype=int, per="world", default=-1, doc="Step of the first entity; -1 before.")
    is_known = State(dtype=bool, per="entity", doc="Whether an entity has been counted.")

    def start(self, w: WorldView) -> None:
        self._count(w)

    def step(self, w: WorldView) -> None:
        self._count(w)
        n_since = round(w.dt / w.context.clock.dt)
        np.add.at(self.n_steps, (w.team_numbers(w.team), w.world), n_since)
        met = w.inbox(EntityCollided)
        if met.n:
            is_team = met.first_team == met.second_team
            for team in (w.team_numbers(met.first_team), w.team_numbers(met.second_team)):
                np.add.at(self.n_team, (team[is_team], met.world[is_team]), 1)
                np.add.at(self.n_non_team, (team[~is_team], met.world[~is_team]), 1)
        down = w.inbox(EntityHitGround)
        if down.n:
            np.add.at(self.n_ground, (w.team_numbers(down.team), down.world), 1)

    def _count(self, w: WorldView) -> None:
        rows = np.flatnonzero(~self.is_known)
        if len(rows):
            world = w.world[rows]
            np.add.at(self.n_entities, (w.team_numbers(w.team[rows]), world), 1)
            self.first_step[world] = np.where(
                self.first_step[world] < 0, w.step_count[world], self.first_step[world]
            )
            self.is_known[rows] = True

    def result(self, w: WorldView) -> dict[str, np.ndarray]:
        dt = w.context.clock.dt
        flight_time = self.n_steps * dt
        played = np.where(self.first_step < 0, 0, w.step_count - self.first_step) * dt
        norm = np.where(played > 0.0, flight_time / np.where(played > 0.0, played, 1.0), 0.0)
        score = (
            self.flight_time_w * norm
            + self.team_collisions_w * self.n_team
            + self.non_team_collisions_w * self.n_non_team
        )
        return {
            "entity_count": self.n_entities,
            "flight_time": flight_time,
            "flight_time_norm": norm,
            "non_team_coll": self.n_non_team,
            "team_coll": self.n_team,
            "ground_coll": self.n_ground,
            "score": score,
        }
