"""Births as SCRIMMAGE places entities."""

from __future__ import annotations

import math

import numpy as np

from tussle.api.bodies import Bodies
from tussle.engine.births import HEADING, Births, Occupancy
from tussle.numeric import rng
from tussle.numeric.quaternion import quat_from_euler
from tussle.numeric.rng import stream_key


class HistoricBirths(Births):
    """Births by the rules of SCRIMMAGE, where tussle's differ.

    All entities of a block are placed at its position. They are scattered only with `scatter_first`, or if an interaction rejects that
    position; without SimpleCollision, they all start at one point. Each heading is drawn around the heading of the previous entity of
    the block. Positions [m] and headings [deg] are rounded to six decimals. The initial `speed` points East. A slot has at most one
    birth per step, and the time of its next birth is counted from the step, not from the due time. Placement "uniform", which
    SCRIMMAGE no longer has, works as in tussle. A birth without a free position ends the game.
    """

    may_wait = False

    def create(
        self,
        new: Bodies,
        mine: slice,
        block: int,
        worlds: np.ndarray,
        where: dict[str, np.ndarray] | None = None,
        occupancy: Occupancy | None = None,
    ) -> None:
        super().create(new, mine, block, worlds, where, occupancy)
        where = where or {}
        spec = self.overrides.mission.blocks[block]
        if "pos" not in where:
            new.pos[:, mine] = _rounded(new.pos[:, mine])
        if "quat" not in where:
            new.quat[:, mine] = self._attitudes(block, worlds, new.block_index[mine])
        if "vel" not in where and spec.velocity is None:
            new.vel[:, mine] = 0.0
            new.vel[0, mine] = self.overrides.block_values(spec, ("speed",), worlds)[0]

    def _first_places(self, block: int, worlds: np.ndarray, pos: np.ndarray) -> None:
        spec = self.overrides.mission.blocks[block]
        if spec.placement == "normal" and not spec.scatter_first:
            pos[:] = self.overrides.block_values(spec, ("position",), worlds)

    def _attitudes(self, block: int, worlds: np.ndarray, places: np.ndarray) -> np.ndarray:
        """Quaternions, (4, m), of entities by their worlds and numbers in the block, (m,) each."""
        spec = self.overrides.mission.blocks[block]
        names = ("heading", "heading_variance", "climb", "roll")
        heading, variance, climb, roll = (
            np.broadcast_to(v, worlds.shape) for v in self.overrides.block_values(spec, names, worlds)
        )
        yaw = _rounded_in_degrees(heading)
        for i in np.flatnonzero(variance > 0.0):
            seeds = np.full(places[i] + 1, self.seeds[worlds[i]] ^ self.keys[block])
            steps = rng.normal(
                seeds, int(HEADING), np.arange(places[i] + 1), np.zeros(places[i] + 1, np.int64)
            )[0]
            at = heading[i]
            for step in steps:  # each number of the walk is rounded
                at = _rounded_in_degrees(at + math.sqrt(variance[i]) * step)
            yaw[i] = at
        return np.stack(quat_from_euler(roll, -climb, yaw))

    def due(self, t: np.ndarray, running: np.ndarray) -> dict[int, np.ndarray]:
        found: dict[int, np.ndarray] = {}
        for i, block in enumerate(self.overrides.mission.blocks):
            if block.rate is None:
                continue
            parts = []
            for slot in range(block.slots):
                is_due = running & (self.next_time[i][:, slot] <= t + 1e-9) & (self.n_left[i] > 0)
                worlds = np.flatnonzero(is_due)
                self.n_left[i, worlds] -= 1
                parts.append(worlds)
                seeds, number = self.seeds[worlds] ^ self.keys[i], self.n_born[i, worlds]
                jitter = rng.normal(seeds, stream_key("birth", "birth"), np.full(len(worlds), slot), number)[
                    0
                ]
                now, wait = t[worlds], 1.0 / block.rate
                later = now + wait + block.interval_sd * jitter
                self.next_time[i][worlds, slot] = np.where(later > now, later, now + wait)
            if any(map(len, parts)):
                found[i] = np.sort(np.concatenate(parts), kind="stable")
        return found


def _rounded(values: np.ndarray) -> np.ndarray:
    """Return numbers rounded by writing and reading them with six decimals."""
    return np.char.mod("%.6f", values).astype(float)


def _rounded_in_degrees(angle: np.ndarray) -> np.ndarray:
    """Return angles [rad] rounded by writing and reading them in degrees with six decimals."""
    return np.asarray(_rounded(angle * (180.0 / math.pi)) * (math.pi / 180.0))
