"""SphereNetwork: radio with a limited range."""

from tussle.stock.network.sphere_network.plugin import SphereNetwork

__all__ = ["SphereNetwork"]
