"""Capture counts."""

from __future__ import annotations

import numpy as np

from tussle.api import Metric, Param, State, WorldView
from tussle.declare.messages import EntityCaptured


class SimpleCaptureMetrics(Metric):
    """Counts captures of team mates and of others, credited to the captor's team; the score is their weighted sum."""

    grade = "portable"

    TeamCapture_weight = Param(1.0, doc="Score for capturing a team mate.")
    NonTeamCapture_weight = Param(1.0, doc="Score for capturing an entity of another team.")
    team_captures = State(dtype=int, per="team", doc="Team mates captured so far.")
    non_team_captures = State(dtype=int, per="team", doc="Entities of other teams captured so far.")

    def step(self, w: WorldView) -> None:
        captured = w.inbox(EntityCaptured)
        if captured.n:
            is_team = captured.source_team == captured.target_team
            team = w.team_numbers(captured.source_team)
            np.add.at(self.team_captures, (team[is_team], captured.world[is_team]), 1)
            np.add.at(self.non_team_captures, (team[~is_team], captured.world[~is_team]), 1)

    def result(self, w: WorldView) -> dict[str, np.ndarray]:
        score = (
            self.TeamCapture_weight * self.team_captures + self.NonTeamCapture_weight * self.non_team_captures
        )
        return {"TeamCapture": self.team_captures, "NonTeamCapture": self.non_team_captures, "score": score}
