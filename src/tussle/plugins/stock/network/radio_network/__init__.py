"""RadioNetwork: radio with fading, bandwidth, queues and jammers."""

from tussle.plugins.stock.network.radio_network.plugin import RadioNetwork

__all__ = ["RadioNetwork"]
