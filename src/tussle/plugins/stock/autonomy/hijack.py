"""A robot that somebody else flies for some time."""

from __future__ import annotations

import numpy as np

from tussle.api import Autonomy, Children, GroupView
from tussle.api.channel_fault import TimedFault


class Hijack(TimedFault, Autonomy):
    """Runs the entity's own autonomies, and those of an adversary in their place while the entity is hijacked.

    The adversary's autonomies begin with the memory of a new entity, and so do its own when the entity is given back. They know what its
    own know: its team and sensors stay. Without an adversary, the entity keeps the commands that it had. The autonomies of each list
    write the channels of the entity; if several write one channel, the last one wins.
    """

    grade = "portable"

    autonomies = Children(Autonomy, shares_channels=True, doc="Its own autonomies.")
    adversary = Children(Autonomy, shares_channels=True, doc="Those of the adversary, scripted or learned.")

    def step(self, g: GroupView) -> None:
        """Step the autonomies of who has the entity."""
        was_hijacked = self.is_faulty.copy()
        begins = self.begin(g)
        ends = was_hijacked & ~self.is_faulty
        for plugins, mine, new in (
            (self.autonomies, ~self.is_faulty, ends),
            (self.adversary, self.is_faulty, begins),
        ):
            for plugin in plugins:
                g.restart(plugin, np.flatnonzero(new))
                g.step(plugin, mine)
