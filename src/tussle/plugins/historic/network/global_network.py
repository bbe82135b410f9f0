"""GlobalNetwork as in SCRIMMAGE."""

from __future__ import annotations

from tussle.plugins.stock.network import global_network


class GlobalNetwork(global_network.GlobalNetwork):
    """GlobalNetwork that holds delayed messages back until another message is published on their topic, however late that is."""

    waits_for_traffic = True
