"""EnforceBoundaryInteraction: removes entities outside regions."""

from tussle.stock.interaction.enforce_boundary_interaction.plugin import EnforceBoundaryInteraction

__all__ = ["EnforceBoundaryInteraction"]
