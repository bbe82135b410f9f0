"""A region and who crosses its edge."""

from tussle.stock.interaction.boundary.plugin import Boundary

__all__ = ["Boundary"]
