"""EnforceBoundaryInteraction: removes entities outside regions."""

from tussle.plugins.stock.interaction.enforce_boundary_interaction.plugin import EnforceBoundaryInteraction

__all__ = ["EnforceBoundaryInteraction"]
