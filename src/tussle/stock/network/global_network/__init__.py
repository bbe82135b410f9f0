"""GlobalNetwork: messages to all entities."""

from tussle.stock.network.global_network.plugin import GlobalNetwork

__all__ = ["GlobalNetwork"]
