"""Decisions on capture claims."""

from __future__ import annotations

import numpy as np

from tussle.api import Interaction, Param, WorldView
from tussle.declare.messages import CaptureEntity, EntityCaptured, Messages
from tussle.numeric.ways import closest_approach


class SimpleCapture(Interaction):
    """Decides capture claims (`CaptureEntity`) at the end of the step in which they are made. A claim is valid within `capture_range`.

    The distance of a claim is the least one on the straight ways of both entities in the step, so that a fast prey can be claimed before
    it passes. With `between_steps="false"` it is that at the end of the step, as in the code of the 2018 paper.

    By default each capture is credited once, to the nearest claimant (on ties the smaller id). With `credit="each"` every valid claim
    counts, as in the code of the 2018 paper: a prey claimed by k predators in one step scores k. SCRIMMAGE decided one step
    late and made a target immune for the rest of the run after a failed claim; here it can be claimed again.
    """

    grade = "portable"
    reads_start_positions = True

    capture_range = Param(5.0, unit="m", ge=0.0, doc="Largest distance of a valid claim.")
    between_steps = Param(True, doc="Measure on the ways of the step; otherwise at its end.")
    enable_team_captures = Param(True, doc="Allow captures of team mates.")
    enable_non_team_captures = Param(True, doc="Allow captures of entities of other teams.")
    credit = Param("once", choices=("once", "each"), doc="Count a capture once, or once per valid claim.")
    effect = Param("remove", choices=("remove", "teleport", "heal"), doc="What happens to captured entities.")
    teleport_to = Param(
        (0.0, 0.0, 0.0), fields="x y z", unit="m", doc="New position, with effect='teleport'."
    )
    healed_health = Param(1.0, gt=0.0, doc="New health, with effect='heal'.")

    def step(self, w: WorldView) -> None:
        claims = w.inbox(CaptureEntity)
        if not claims.n:
            return
        source, target, world = self._valid(w, claims)
        if not len(source):
            return
        w.publish(
            EntityCaptured, world, source=w.id[source], target=w.id[target],
            source_team=w.team[source], target_team=w.team[target],
        )  # fmt: skip
        self._apply(w, np.unique(target))

    def _valid(self, w: WorldView, claims: Messages) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the rows of captor and captured, and the world, of each valid and credited claim."""
        source, target = w.rows_at(claims.world, claims.sender), w.rows_at(claims.world, claims.target)
        is_there = (source >= 0) & (target >= 0)
        source, target, world = source[is_there], target[is_there], claims.world[is_there]
        end, begin = (pos[:, target] - pos[:, source] for pos in (w.pos, w.start_pos))
        _, distance = closest_approach(end, self.between_steps[world] * (begin - end))
        is_team = w.team[source] == w.team[target]
        allowed = np.where(is_team, self.enable_team_captures[world], self.enable_non_team_captures[world])
        valid = np.flatnonzero((distance <= self.capture_range[world]) & allowed)
        if self.credit == "once":
            best = valid[np.lexsort((w.id[source[valid]], distance[valid], target[valid]))]
            is_first = np.ones(len(best), bool)
            is_first[1:] = target[best[1:]] != target[best[:-1]]
            valid = np.sort(best[is_first])
        return source[valid], target[valid], world[valid]

    def _apply(self, w: WorldView, rows: np.ndarray) -> None:
        if self.effect == "remove":
            w.kill(rows, "captured")
        elif self.effect == "teleport":
            w.move(rows, pos=self.teleport_to[:, w.world[rows]])
        else:
            w.bodies.health[rows] = self.healed_health[w.world[rows]]
