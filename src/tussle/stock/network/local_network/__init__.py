"""The plugins of one entity among themselves."""

from tussle.stock.network.local_network.plugin import LocalNetwork

__all__ = ["LocalNetwork"]
