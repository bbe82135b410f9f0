"""Captures of intruders by the defenders of a region."""

from __future__ import annotations

import numpy as np

from tussle.api import Interaction, Param, State, WorldView
from tussle.declare.messages import EntityCaptured
from tussle.numeric import clip
from tussle.numeric.ways import closest_approach
from tussle.world.scene import Volume

FAR = 1e150
"""Length of a way that does not count [m]: its square would overflow."""


class CaptureInBoundaryInteraction(Interaction):
    """Entities of a boundary's team capture others that come within `capture_range`, if both are inside the boundary.

    In a step entities move straight; what counts is their least distance while the defender is ready, and whether each was inside at some
    time of the step.

    Each intruder is captured by its nearest defender (on ties the smaller id). Without a cool-down, a defender captures all of these
    in one step; with one, the nearest, and then nobody until the cool-down has passed. In SCRIMMAGE distances were measured
    at the positions of the start of the step.

    Raises:
        MissionError: `boundary_id` is not the id of exactly one boundary of the mission.
    """

    grade = "portable"
    reads_start_positions = True

    boundary_id = Param(1, structural=True, doc="Boundary that is defended by its team.")
    capture_range = Param(5.0, unit="m", ge=0.0, doc="Distance below which intruders are captured.")
    cool_down_period = Param(0.0, unit="s", ge=0.0, doc="Time from a capture to the defender's next one.")
    ready_at = State(unit="s", default=-np.inf, per="entity", doc="Time of the entity's next capture.")

    def named_regions(self) -> tuple[int, ...]:
        """Return the defended boundary."""
        return (self.values["boundary_id"],)

    def step(self, w: WorldView) -> None:
        region = w.region(self.boundary_id)
        is_inside = self._is_inside(w, region.shape)
        now = w.t[w.world] + 1e-6 * w.dt
        has_intruders = np.bincount(w.world[is_inside & (w.team != region.team)], minlength=w.n_worlds) > 0
        defends = is_inside & (w.team == region.team) & (now >= self.ready_at) & has_intruders[w.world]
        if not defends.any():
            return
        row, other, distance = self._near(w, np.where(defends, self.capture_range[w.world], 0.0))
        order = np.lexsort((w.id[row], distance))
        order = order[is_inside[other[order]]]
        order = order[_first_of(other[order])]
        if not len(order):
            return
        cools = self.cool_down_period[w.world[row[order]]] > 0.0
        order = order[~cools | _first_of(row[order])]
        source, target = row[order], other[order]
        self.ready_at[source] = w.t[w.world[source]] + self.cool_down_period[w.world[source]]
        w.publish(
            EntityCaptured, w.world[source], source=w.id[source], target=w.id[target],
            source_team=w.team[source], target_team=w.team[target],
        )  # fmt: skip
        w.kill(target, "captured")

    def _near(self, w: WorldView, reach: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Rows of defenders and of others nearer than `reach` [m], (n,), and their distances [m], (m,) each."""
        ways = w.pos - w.start_pos
        x, y, z = ways
        far = np.sqrt(x * x + y * y + z * z)
        far = np.where(far < FAR, far, 0.0)
        farthest = np.zeros(w.n_worlds)
        np.maximum.at(farthest, w.world, far)
        wide = reach + (1.0 + 1e-9) * (far + farthest[w.world])
        near = w.near(np.where(reach > 0.0, wide, 0.0), teams="other")
        row, other = near.row, near.other
        offset, way = (v[:, other] - v[:, row] for v in (w.pos, ways))
        begin = clip(1.0 - (w.t[w.world[row]] - self.ready_at[row]) / w.dt, 0.0, 1.0)
        distance = np.minimum(closest_approach(offset - way, way, begin)[1], near.distance)
        is_near = distance < reach[row]
        return row[is_near], other[is_near], distance[is_near]

    def _is_inside(self, w: WorldView, shape: Volume) -> np.ndarray:
        """Return which entities were in a region during the step, (n,)."""
        return shape.crossed(w.start_pos, w.pos)


def _first_of(values: np.ndarray) -> np.ndarray:
    """Return whether each value, (m,), occurs for the first time."""
    is_first = np.zeros(len(values), bool)
    is_first[np.unique(values, return_index=True)[1]] = True
    return is_first
