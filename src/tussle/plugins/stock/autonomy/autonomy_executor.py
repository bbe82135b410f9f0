"""An autonomy that switches between others by the state of the entity."""

from __future__ import annotations

import numpy as np

from tussle.api import Autonomy, Children, GroupView, HistoricAttributes, Param, StateFollower


class AutonomyExecutor(StateFollower):
    """Runs, in order, those of its autonomies that act in the entity's state. Autonomies without `states` always run.

    Messages on the topic `state_topic_name` set the state, for instance those of GraphvizFSM. When an autonomy becomes active again, its
    memory is reset to that of a new entity. The autonomies write the channels of the entity: if several write one channel, the last one
    wins, and a channel that none writes keeps its value.
    """

    grade = "portable"
    historic_attributes = HistoricAttributes(
        differs={
            "autonomies": "AutonomyExecutor without autonomies does nothing; in SCRIMMAGE it has Straight"
        }
    )

    network_name = Param("LocalNetwork", doc="Network that carries the state.")
    autonomies = Children(Autonomy, by_state=True, shares_channels=True, doc="The autonomies.")

    def step(self, g: GroupView) -> None:
        before = self.state.copy()
        self.read_state()
        for autonomy in self.autonomies:
            acts, acted = self.acts(autonomy), self.acts(autonomy, before)
            if acts is not None and acted is not None:
                g.restart(autonomy, np.flatnonzero(acts & ~acted))
            g.step(autonomy, acts)
