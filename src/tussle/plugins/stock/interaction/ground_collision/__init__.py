"""GroundCollision: removes or supports entities that reach the ground."""

from tussle.plugins.stock.interaction.ground_collision.plugin import GroundCollision

__all__ = ["GroundCollision"]
