"""Predator as in SCRIMMAGE."""

from __future__ import annotations

from tussle.api import GroupView, Param
from tussle.plugins.stock.autonomy import predator


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
