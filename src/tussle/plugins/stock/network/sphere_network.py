"""Radio with a limited range."""

from __future__ import annotations

from collections.abc import Sequence

from tussle.api import Links, Messages, Network, Param, WorldView
from tussle.api.links import BLOCKS


class SphereNetwork(Network):
    """Delivers a message to each entity nearer than `range` with probability `prob_transmit`, and always to the sender.

    Distances are measured at the end of the step in which the message is sent. SCRIMMAGE measured from the sender's new
    position to the old positions of the others, and could lose messages of an entity to itself.
    """

    grade = "portable"

    range = Param(100.0, unit="m", ge=0.0, doc="Distance below which messages are received.")
    prob_transmit = Param(1.0, ge=0.0, le=1.0, doc="Probability that a receiver gets a message.")
    filter_comms_plane = Param(
        False, doc="Block messages across a horizontal plane, such as the water surface."
    )
    comms_boundary_altitude = Param(0.0, unit="m", doc="Altitude of the plane.")
    comms_boundary_epsilon = Param(0.0, unit="m", ge=0.0, doc="Distance by which both sides overlap.")

    blocked_by = Param(
        "nothing", choices=BLOCKS, doc="Obstacles between sender and receiver that block a message."
    )

    losses = ("plane", "chance", "blocked")

    def transmit(self, w: WorldView, outboxes: Sequence[Messages]) -> Links:
        links = self._links(w, outboxes)
        plane = self.filter_comms_plane, self.comms_boundary_altitude, self.comms_boundary_epsilon
        links.lose_across(w, 0, *plane)
        links.lose_hidden(w, 2, self.blocked_by)
        links.lose_by_chance(w, 1, "loss", self.prob_transmit)
        return links

    def _links(self, w: WorldView, outboxes: Sequence[Messages]) -> Links:
        """Links within the range."""
        return Links(w, outboxes, self.range[w.world])
