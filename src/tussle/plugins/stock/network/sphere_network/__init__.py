"""SphereNetwork: radio with a limited range."""

from tussle.plugins.stock.network.sphere_network.plugin import SphereNetwork

__all__ = ["SphereNetwork"]
