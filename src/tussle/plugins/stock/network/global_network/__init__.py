"""GlobalNetwork: messages to all entities."""

from tussle.plugins.stock.network.global_network.plugin import GlobalNetwork

__all__ = ["GlobalNetwork"]
