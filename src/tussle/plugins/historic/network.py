"""Networks with the laws of SCRIMMAGE."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tussle.api import Links, Messages, WorldView
from tussle.plugins.stock.network import global_network, local_network, sphere_network


class GlobalNetwork(global_network.GlobalNetwork):
    """GlobalNetwork that holds delayed messages back until another message is published on their topic, however late that is."""

    waits_for_traffic = True


class LocalNetwork(local_network.LocalNetwork):
    """LocalNetwork that holds delayed messages back until another message is published on their topic, however late that is."""

    waits_for_traffic = True


class SphereNetwork(sphere_network.SphereNetwork):
    """SphereNetwork that measures from the sender after the motion to the others before it, and can lose messages to the sender itself.

    If both entities of a pair send in a step, the distance that the one with the smaller id measures holds for both. Delayed messages
    are held back until another message is published on their topic.
    """

    waits_for_traffic = True
    reads_start_positions = True

    def _links(self, w: WorldView, outboxes: Sequence[Messages]) -> Links:
        moved = w.pos - w.start_pos
        farthest = np.sqrt((moved * moved).sum(axis=0)).max(initial=0.0)
        reach = self.range[w.world]
        links = Links(w, outboxes, reach + 2.0 * farthest + 1e-6)
        sender, receiver = links.sender[links.message], links.receiver
        sends = np.zeros(w.n, bool)
        sends[links.sender[links.sender >= 0]] = True
        swaps = sends[receiver] & (w.id[receiver] < w.id[sender])
        measures, other = np.where(swaps, [receiver, sender], [sender, receiver])
        x, y, z = w.start_pos[:, other] - w.pos[:, measures]
        links.distance = np.sqrt(x * x + y * y + z * z)
        links.keep(links.distance < reach[receiver])
        own = links.sender >= 0
        world, ids = links.world[own], w.id[links.sender[own]]
        draw = w.uniform_by("own loss", world, links.key[own], ids)
        links.reaches_sender[own] = draw < self.prob_transmit[world]
        return links
