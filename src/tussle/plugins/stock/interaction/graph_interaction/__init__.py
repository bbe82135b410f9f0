"""GraphInteraction: publishes a road graph."""

from tussle.plugins.stock.interaction.graph_interaction.plugin import GraphInteraction

__all__ = ["GraphInteraction"]
