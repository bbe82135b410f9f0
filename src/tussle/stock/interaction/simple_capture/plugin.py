"""The referee of captures."""

from __future__ import annotations

import numpy as np

from tussle.api import Interaction, Param, WorldView
from tussle.messages import Batch, CaptureEntity, EntityCaptured


class SimpleCapture(Interaction):
    """Judges claims (`CaptureEntity`) in the step they are made, after all have moved: one holds within `capture_range`.

    By default each capture is credited once, to the nearest claimant (the smaller id when equally near). With `credit="each"` every
    claim that holds counts, as the code of the 2018 paper did: a prey claimed by k predators in one step scores k. The historic
    referee judged one step late and made a target whose claim had failed immune for the rest of the run; here it can be claimed again.
    """

    grade = "portable"

    capture_range = Param(5.0, unit="m", ge=0.0, doc="Largest distance at which a claim holds.")
    enable_team_captures = Param(True, doc="Team mates can be captured.")
    enable_non_team_captures = Param(True, doc="Others can be captured.")
    credit = Param(
        "once", choices=("once", "each"), doc="Whether a capture counts once, or once per claim that holds."
    )
    effect = Param("remove", choices=("remove", "teleport", "heal"), doc="What becomes of the captured.")
    teleport_to = Param((0.0, 0.0, 0.0), fields="x y z", unit="m", doc="With teleport: where they are put.")
    healed_health = Param(1.0, gt=0.0, doc="With heal: their health afterwards.")

    def step(self, w: WorldView) -> None:
        claims = w.inbox(CaptureEntity)
        if not claims.n:
            return
        source, target, world = self._holding(w, claims)
        if not len(source):
            return
        w.publish(
            EntityCaptured, world, source=w.id[source], target=w.id[target],
            source_team=w.team[source], target_team=w.team[target],
        )  # fmt: skip
        self._apply(w, np.unique(target))

    def _holding(self, w: WorldView, claims: Batch) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Rows of captor and captured, and world, of the claims that hold and are credited."""
        source, target = w.rows_at(claims.world, claims.sender), w.rows_at(claims.world, claims.target)
        is_there = (source >= 0) & (target >= 0)
        source, target, world = source[is_there], target[is_there], claims.world[is_there]
        dx, dy, dz = w.pos[:, target] - w.pos[:, source]
        distance = np.sqrt(dx * dx + dy * dy + dz * dz)
        is_team = w.team[source] == w.team[target]
        allowed = np.where(is_team, self.enable_team_captures[world], self.enable_non_team_captures[world])
        holds = np.flatnonzero((distance <= self.capture_range[world]) & allowed)
        if self.credit == "once":
            best = holds[np.lexsort((w.id[source[holds]], distance[holds], target[holds]))]
            is_first = np.ones(len(best), bool)
            is_first[1:] = target[best[1:]] != target[best[:-1]]
            holds = np.sort(best[is_first])
        return source[holds], target[holds], world[holds]

    def _apply(self, w: WorldView, rows: np.ndarray) -> None:
        if self.effect == "remove":
            w.kill(rows, "captured")
        elif self.effect == "teleport":
            w.move(rows, pos=self.teleport_to[:, w.world[rows]])
        else:
            w.bodies.health[rows] = self.healed_health[w.world[rows]]
