"""SimpleCapture as in SCRIMMAGE."""

from __future__ import annotations

import numpy as np

from tussle.api import State, WorldView
from tussle.declare.messages import CaptureEntity, EntityCaptured
from tussle.plugins.stock.interaction import simple_capture


class SimpleCapture(simple_capture.SimpleCapture):
    """SimpleCapture that decides one step late, and only the first claim on each entity.

    A claim of a step is decided after the motion of the next one; the claims of the last step are lost. If several claim an
    entity, the smallest id counts. If it is out of range by then, the entity can never be captured: all later claims are
    ignored. A claim whose claimant is gone, at which SCRIMMAGE crashes, captures nobody.
    """

    claimant = State(
        dtype=int,
        per="entity",
        doc="Id of the entity whose claim on this one is to be decided; 0 if there is none.",
    )
    is_decided = State(dtype=bool, per="entity", doc="Whether a claim on the entity has been decided.")

    def step(self, w: WorldView) -> None:
        self._decide(w, np.flatnonzero(self.claimant > 0))
        claims = w.inbox(CaptureEntity)
        target = w.rows_at(claims.world, claims.target)
        open_claims = np.flatnonzero(target >= 0)
        open_claims = open_claims[~self.is_decided[target[open_claims]]]
        # inbox() orders by world and sender: the first claim on each target is that of the smallest id.
        rows, first = np.unique(target[open_claims], return_index=True)
        self.claimant[rows] = claims.sender[open_claims[first]]

    def _decide(self, w: WorldView, target: np.ndarray) -> None:
        """Decide the claims on some rows, (m,)."""
        world = w.world[target]
        source = w.rows_at(world, self.claimant[target])
        self.claimant[target] = 0
        self.is_decided[target] = True
        target, source, world = target[source >= 0], source[source >= 0], world[source >= 0]
        dx, dy, dz = w.pos[:, target] - w.pos[:, source]
        is_team = w.team[source] == w.team[target]
        allowed = np.where(is_team, self.enable_team_captures[world], self.enable_non_team_captures[world])
        hit = allowed & (np.sqrt(dx * dx + dy * dy + dz * dz) <= self.capture_range[world])
        target, source, world = target[hit], source[hit], world[hit]
        w.publish(
            EntityCaptured, world, source=w.id[source], target=w.id[target],
            source_team=w.team[source], target_team=w.team[target],
        )  # fmt: skip
        self._apply(w, target)
