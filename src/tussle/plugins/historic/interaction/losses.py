"""Interactions that remove entities, as in SCRIMMAGE."""

from __future__ import annotations

import numpy as np

from tussle.api import State, WorldView
from tussle.declare.messages import CaptureEntity, EntityCaptured
from tussle.plugins.stock.interaction import random_attrit, simple_capture, simple_collision
from tussle.plugins.stock.interaction.ground_collision import Ground


class GroundCollision(Ground):
    """GroundCollision that reports the entities on the ground in every step, so that a metric counts each step.

    It is no contact: those at or below the level are pushed up with their weight.
    """

    def step(self, w: WorldView) -> None:
        self.is_down[:] = False
        super().step(w)

    def _carry(self, w: WorldView, height: np.ndarray) -> None:
        rows = np.flatnonzero(height <= 0.0)
        if len(rows):
            # Not less than 0: the ground does not hold down what rises.
            w.bodies.force[2, rows] += np.maximum(w.mass_properties().weight[rows], 0.0)


class RandomAttrit(random_attrit.RandomAttrit):
    """RandomAttrit that removes at most one entity per step, by the time at the start of the step.

    SCRIMMAGE's own generator has no seed, so all runs lose the same entities there; here the draws are keyed as in tussle.
    """

    most_per_step = 1

    def _elapsed(self, w: WorldView) -> np.ndarray:
        return super()._elapsed(w) - w.dt


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


class SimpleCollision(simple_collision.SimpleCollision):
    """SimpleCollision that takes pairs in the order of ids, and ignores pairs with an entity just removed.

    So of three that collide, the first pair is removed and the third flies on. Entities that an earlier interaction has removed in the
    step do not collide. Distances are those at the end of the step. In tussle all pairs collide, also between
    two steps. With `init_alt_deconflict`, positions at the range itself are rejected too.
    """

    def _begin(self, w: WorldView) -> np.ndarray:
        return np.asarray(w.pos)

    def _colliding(self, w: WorldView, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        is_gone = np.zeros(w.n, bool)
        for rows, _ in w.deaths:
            is_gone[rows] = True
        kept = []
        for number, (row, other) in enumerate(zip(first, second, strict=True)):
            if not (is_gone[row] or is_gone[other]):
                is_gone[[row, other]] = True
                kept.append(number)
        return np.array(kept, np.int64)

    def rejects(self, w: WorldView, world: int, pos: np.ndarray, taken: np.ndarray) -> bool:
        if self.init_alt_deconflict[world]:
            return bool((np.abs(taken[2] - pos[2]) <= self.startup_collision_range[world]).any())
        return super().rejects(w, world, pos, taken)
