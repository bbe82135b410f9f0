"""BulletCollision: bodies that push each other, and the scene, apart."""

from tussle.stock.interaction.bullet_collision.plugin import BulletCollision

__all__ = ["BulletCollision"]
