"""LocalNetwork: messages between the plugins of one entity."""

from tussle.plugins.stock.network.local_network.plugin import LocalNetwork

__all__ = ["LocalNetwork"]
