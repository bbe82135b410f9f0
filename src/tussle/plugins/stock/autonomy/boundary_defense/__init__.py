"""BoundaryDefense: intercepts intruders in a region."""

from tussle.plugins.stock.autonomy.boundary_defense.plugin import BoundaryDefense

__all__ = ["BoundaryDefense"]
