"""Boundary: a region that reports crossings."""

from tussle.stock.interaction.boundary.plugin import Boundary

__all__ = ["Boundary"]
