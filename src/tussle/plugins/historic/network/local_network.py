"""LocalNetwork as in SCRIMMAGE."""

from __future__ import annotations

from tussle.plugins.stock.network import local_network


class LocalNetwork(local_network.LocalNetwork):
    """LocalNetwork that holds delayed messages back until another message is published on their topic, however late that is."""

    waits_for_traffic = True
