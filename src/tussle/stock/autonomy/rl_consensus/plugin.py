"""Robots that move as an actor says and earn rewards near each other."""

from __future__ import annotations

import numpy as np

from tussle.api import GroupView, Param
from tussle.stock.autonomy.rl_simple.plugin import RLSimple


class RLConsensus(RLSimple):
    """Moves as a Python actor says, and earns rewards near others; see `RLSimple` for actors and actions.

    The reward of a step is the share of the world's entities that are other ones with |x - own x| below `radius`; with
    `reward_type="origin"` it is that of `RLSimple`.

    Differences from the existing system: it divides rewards by the duration of the mission [s].
    """

    grade = "external"

    reward_type = Param(
        "others", choices=("others", "origin"), doc="What is rewarded: to be near others, or near the origin."
    )

    def reward(self, g: GroupView) -> np.ndarray:
        """Rewards of this step, (n,)."""
        if self.reward_type == "origin":
            return super().reward(g)
        reward = np.zeros(g.n)
        for world in np.unique(g.world):
            x = np.sort(g.bodies.pos[0, g.bodies.world == world])
            rows = np.flatnonzero(g.world == world)
            own, radius = g.pos[0, rows], np.broadcast_to(self.radius, g.n)[rows]
            near = np.searchsorted(x, own + radius, "left") - np.searchsorted(x, own - radius, "right")
            reward[rows] = np.maximum(near - 1, 0) / len(x)
        return reward
