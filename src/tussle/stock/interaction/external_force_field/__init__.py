"""ExternalForceField: wind that pushes all entities."""

from tussle.stock.interaction.external_force_field.plugin import ExternalForceField

__all__ = ["ExternalForceField"]
