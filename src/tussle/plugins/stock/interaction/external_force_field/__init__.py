"""ExternalForceField: wind that pushes all entities."""

from tussle.plugins.stock.interaction.external_force_field.plugin import ExternalForceField

__all__ = ["ExternalForceField"]
