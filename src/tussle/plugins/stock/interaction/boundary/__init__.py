"""Boundary: a region that reports crossings."""

from tussle.plugins.stock.interaction.boundary.plugin import Boundary

__all__ = ["Boundary"]
