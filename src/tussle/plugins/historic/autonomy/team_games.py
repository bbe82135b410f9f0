"""Autonomies of games between teams, as in SCRIMMAGE."""

from __future__ import annotations

from typing import Any

import numpy as np

from tussle.api import GroupView, Param
from tussle.plugins.stock.autonomy import auction_assign, boundary_defense, predator, take_flag


class AuctionAssign(auction_assign.AuctionAssign):
    """AuctionAssign in which only the entity with the id 1 can be the auctioneer; in tussle every entity with `auctioneer` is."""

    def spawn(self, g: GroupView, rows: np.ndarray) -> None:
        self.has_started[rows] = g.id[rows] != 1


class BoundaryDefense(boundary_defense.BoundaryDefense):
    """BoundaryDefense that does not add the speed of the intruder to its own, and stands still in the first step.

    In SCRIMMAGE it receives its regions in messages, which are delivered at the end of that step; in tussle all entities have the
    regions of the mission at once. In SCRIMMAGE entities born later never receive them; here they have them too.
    """

    def step(self, g: Any) -> None:
        super().step(g)
        self.velocity[:, g.step_count == 0] = 0.0

    def command(self, way: np.ndarray, _: np.ndarray) -> np.ndarray:
        """Desired velocity [m/s], (3, n): the way [m] in one second."""
        return way


class Predator(predator.Predator):
    """Predator whose pitch_rate has the opposite sign.

    SCRIMMAGE turned the pitch of its vehicles nose down in 2020, but not this command: a pursuer pitches away from its prey, does half a
    loop, and follows upside down, where the sign is right. It claims those that are within range at the start of the step only.
    """

    between_steps = Param(False, doc="Claim those, too, who come within range during the step.")

    def step(self, g: GroupView) -> None:
        # Before the call too: without prey, the last command persists.
        self.pitch_rate[:] *= -1.0
        super().step(g)
        self.pitch_rate[:] *= -1.0


class TakeFlag(take_flag.TakeFlag):
    """TakeFlag that stands still in the first step.

    In SCRIMMAGE it receives its regions in messages, which are delivered at the end of that step; in tussle all entities have the
    regions of the mission at once. In SCRIMMAGE entities born later never receive them; here they have them too.
    """

    def step(self, g: Any) -> None:
        super().step(g)
        self.velocity[:, g.step_count == 0] = 0.0
