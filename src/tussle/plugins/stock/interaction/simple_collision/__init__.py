"""SimpleCollision: removes entities that collide."""

from tussle.plugins.stock.interaction.simple_collision.plugin import SimpleCollision

__all__ = ["SimpleCollision"]
